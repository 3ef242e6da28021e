"""Goals that numerics are chosen for: powers of ten within a tolerance."""

import math


def goal_above(floor: float, tolerance: float) -> float:
    """Return the goal of a tolerance where roundings leave this floor."""
    return max(decade_within(tolerance), decade_within(floor))


def decade_within(tolerance: float) -> float:
    """Return the largest power of ten that is not above a tolerance."""
    # The logarithm of a power of ten may come out a last digit short of a whole number.
    return 10.0 ** math.floor(math.log10(tolerance) + 1e-9)
