"""Power bond: a spring with one anharmonic term of any integer order."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.named_bond import LARGEST, SMALLEST, NamedBond, Strain
from chaincor.lammps_inputs.errors import PotentialError


class PowerParameters(NamedTuple):
    """Coefficient c of the anharmonic term; each order has its own kernel."""

    c: float


@cache
def power_kernels(order: int) -> tuple[Callable, Callable]:
    """
    Return the kernels of force and curvature for an order.

    The order is then known to the compiler, which replaces the power by a few multiplications.
    """
    exponent, factor = order - 2, order * (order - 1)

    def force(strain: Strain, parameters: PowerParameters) -> Strain:
        """Return -s - order c s^(order - 1)."""
        return -strain * (1.0 + order * parameters.c * strain**exponent)

    def curvature(strain: Strain, parameters: PowerParameters) -> Strain:
        """Return 1 + order (order - 1) c s^(order - 2)."""
        return 1.0 + factor * parameters.c * strain**exponent

    force.__qualname__, curvature.__qualname__ = f"power{order}_force", f"power{order}_curvature"
    return force, curvature


@dataclass(frozen=True)
class Power(NamedBond):
    """U = s^2/2 + c s^order; c > 0 for even order, c < 0 for odd order."""

    order: int
    c: float

    name = "power"
    title = "power"
    keys: ClassVar = {"power_order": "order", "power_c": "c"}
    example: ClassVar = {"order": 4, "c": 1.0}
    parameters_type = PowerParameters
    constants: ClassVar = {"exponent": "order - 2", "factor": "order * (order - 1)"}
    lammps_formula = "{s}*{s}*(0.5+({bond.c!r})*{s}^({bond.order}-2))"

    def __post_init__(self) -> None:
        """Refuse orders below 3, and c if its sign makes bonds soften under compression."""
        if self.order < 3:
            raise PotentialError(f"power_order is {self.order}. Give an integer of 3 or more")
        sign, word = (1, "positive") if self.order % 2 == 0 else (-1, "negative")
        if not SMALLEST <= self.c * sign <= LARGEST:
            raise PotentialError(
                f"power_c is {self.c!r}. For order {self.order} give a {word} number, such as "
                f"{sign}.0, of size {SMALLEST:g} to {LARGEST:g}, so that compression stiffens "
                "the bond"
            )

    @property
    def force_kernel(self) -> Callable:  # type: ignore[override]
        """Kernel of the force for this order."""
        return power_kernels(int(self.order))[0]

    @property
    def curvature_kernel(self) -> Callable:  # type: ignore[override]
        """Kernel of U'' for this order."""
        return power_kernels(int(self.order))[1]

    @property
    def anharmonic_order(self) -> int:  # type: ignore[override]
        """Order of the anharmonic term."""
        return self.order

    def energy(self, strain: ArrayLike) -> Array:
        """Return s^2 (1/2 + c s^(order - 2))."""
        s = np.asarray(strain, dtype=float)
        return s * s * (0.5 + self.c * s ** (self.order - 2))

    @property
    def convex_strain(self) -> float:  # type: ignore[override]
        """Strain at which U'' = 0 in a stretched bond of odd order; inf for even orders."""
        if self.order % 2 == 0:
            return math.inf
        return (-self.order * (self.order - 1) * self.c) ** (-1.0 / (self.order - 2))

    @property
    def barrier_strain(self) -> float:  # type: ignore[override]
        """Strain at which U' = 0 in a stretched bond of odd order; inf for even orders."""
        if self.order % 2 == 0:
            return math.inf
        return (-self.order * self.c) ** (-1.0 / (self.order - 2))

    def _find_compressed_strain(self) -> float | None:
        """Solve |c| |s|^(order - 2) = 1/2 in closed form."""
        return -((2.0 * abs(self.c)) ** (-1.0 / (self.order - 2)))
