r"""
Compute the force of a damped contact during one kick, in which positions do not change.

Two bodies that open their gap at the speed w feel the force :math:`f(w) = \max(F - c w, 0)`: bodies
that part do not pull. With the sum 1/mu of their inverse masses and the acceleration a of the gap
by the bonds, :math:`\dot w = a + f(w)/\mu`. This equation is solved exactly, so kicks stay as
symmetric as those of forces without damping. A kick in which f reaches zero is an exception.
"""

from collections.abc import Callable

import numpy as np


def build_mean_force(drag: Callable, register: Callable) -> Callable:
    """
    Return ``mean_force(force, strain, rate, others, inverse, kick, law)``.

    It is the mean force of a contact during a kick. `force` is the force F without damping, and
    `drag` the kernel of c. `rate` is w before the kick, `others` is a, and `inverse` is 1/mu.
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
    """Return ``damped_force(force, strain, rate, law)``: the force at one moment."""

    @register
    def damped_force(force: float, strain: float, rate: float, law: tuple) -> float:
        return max(0.0, force - drag(strain, law) * rate)

    return damped_force
