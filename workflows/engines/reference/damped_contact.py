r"""
Compute the force of a damped contact during a kick.

If the gap between two bodies opens at the speed w, the contact force is :math:`f(w) = \max(F - c w,
0)`, because bodies that part do not attract. The bonds accelerate the gap by a, and 1/mu is the sum
of the inverse masses of both particles in contact. Then :math:`\dot w = a + f(w)/\mu`. Positions do
not change during a kick, and this equation is solved exactly. Kicks therefore stay as symmetric as
those without damping, except for a kick in which f reaches zero.
"""

from collections.abc import Callable

import numpy as np


def build_mean_force(drag: Callable, register: Callable) -> Callable:
    """
    Return ``mean_force(force, strain, rate, others, inverse, kick, law)``.

    The function returns the mean contact force during a kick. `force` is the force F without
    damping, and `drag` computes c. `rate` is w before the kick, `others` is a, and `inverse` is
    1/mu.
    """

    @register
    def mean_force(
        force: float,
        strain: float,
        rate: float,
        others: float,
        inverse: float,
        kick: float,
        law: tuple,
    ) -> float:
        factor = drag(strain, law)
        decay = factor * inverse * kick
        if decay == 0.0:
            return force
        share = -np.expm1(-decay) / decay
        return max(0.0, (force - factor * rate) * share - others / inverse * (1.0 - share))

    return mean_force


def build_damped_force(drag: Callable, register: Callable) -> Callable:
    """Return ``damped_force(force, strain, rate, law)``: the contact force at one moment."""

    @register
    def damped_force(force: float, strain: float, rate: float, law: tuple) -> float:
        return max(0.0, force - drag(strain, law) * rate)

    return damped_force
