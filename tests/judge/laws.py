"""Define the judge's own force laws as functions of the strain, without cancellation."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.judge import steps

Array = NDArray[np.float64]

KINDS = {
    "harmonic": steps.HARMONIC,
    "lj": steps.LJ,
    "toda": steps.TODA,
    "log": steps.LOG,
    "power": steps.POWER,
}


@dataclass(frozen=True)
class Law:
    """
    A bond's law: its name as in the package, with b for toda, order and c for power.

    Energies are zero at natural length, and the stiffness there is 1.
    """

    name: str
    b: float = 10.0
    order: int = 4
    c: float = 1.0

    def __post_init__(self):
        if self.name not in KINDS:
            raise ValueError(f"law {self.name!r}: expected one of {', '.join(KINDS)}")
        if self.name == "power" and (self.order != int(self.order) or self.order < 3):
            raise ValueError(f"power law of order {self.order}: expected an integer from 3")

    @property
    def parameter(self) -> float:
        """Parameter of the recurrences."""
        return self.b if self.name == "toda" else self.c

    def energy(self, strain: Array, length: Array | None = None) -> Array:
        """Return U; give the lengths if they are so short that 1 + strain has lost its digits."""
        s = np.asarray(strain, dtype=float)
        if self.name == "harmonic":
            return 0.5 * s**2
        if self.name == "power":
            return 0.5 * s**2 + self.c * s**self.order
        if self.name == "toda":
            y = -self.b * s
            return np.where(np.abs(y) < 0.5, _exp_rest(y), np.expm1(y) - y) / self.b**2
        r = 1.0 + s if length is None else length
        logarithm = np.where(r < 0.5, np.log(r), np.log1p(s))
        if self.name == "log":
            return np.where(np.abs(s) < 0.2, _log_rest(s), s - logarithm)
        return np.expm1(-6.0 * logarithm) ** 2 / 72.0

    @property
    def dissociation(self) -> float:
        """Energy that breaks a bond of this law."""
        return 1.0 / 72.0 if self.name == "lj" else np.inf


@dataclass(frozen=True)
class UserLaw:
    """A bond given by functions."""

    #: U(s) and -U'(s), each compiled by ``numba.njit`` from a float to a float.
    energy_function: Callable[[float], float]
    force: Callable[[float], float]  #: See ``energy_function``.
    dissociation: float = np.inf  #: Energy that breaks the bond.
    name = "user"

    def energy(self, strain: Array, length: Array | None = None) -> Array:
        """Return U."""
        return np.array([self.energy_function(s) for s in strain])


def _exp_rest(y: Array) -> Array:
    """Return exp(y) - 1 - y for |y| < 1/2, without cancellation."""
    total = np.zeros_like(y)
    for k in range(18, 2, -1):
        total = (total + 1.0) * y / k
    return 0.5 * y * y * (1.0 + total)


def _log_rest(s: Array) -> Array:
    """Return s - log(1 + s) for |s| < 0.2, without cancellation."""
    return s * s * np.polynomial.polynomial.polyval(s, [(-1) ** k / (k + 2) for k in range(24)])
