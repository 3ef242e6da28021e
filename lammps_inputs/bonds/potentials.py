"""Bond potentials U(r) as functions of the strain s = r - 1: one class each, used by everything."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.bonds.force_kernels import (
    MorseParameters,
    PowerParameters,
    TodaParameters,
    harmonic_force,
    lj_force,
    log_force,
    log_force_of_log_length,
    morse_force,
    power_force,
    toda_force,
)
from chaincor.lammps_inputs.bonds.potential import Array, LogLength, Potential
from chaincor.lammps_inputs.bonds.series import expm1_minus_x, x_minus_log1p
from chaincor.lammps_inputs.errors import PotentialError

# Parameters whose squares and inverse squares floating point can hold.
_SMALLEST, _LARGEST = 1e-100, 1e100


@dataclass(frozen=True)
class Harmonic(Potential):
    """U = s^2/2."""

    name = "harmonic"
    smooth = is_harmonic = True
    force_kernel = staticmethod(harmonic_force)

    @property
    def anharmonic_order(self) -> int | None:
        """None: there is no anharmonic term."""
        return None

    def energy(self, strain: ArrayLike) -> Array:
        """Return s^2/2."""
        return 0.5 * np.square(strain)

    def lammps_energy(self, strain: str) -> str:
        """Return the formula of U."""
        return f"0.5*{strain}*{strain}"

    def curvature(self, strain: ArrayLike) -> Array:
        """Return 1."""
        return np.ones_like(np.asarray(strain, dtype=float))

    def _find_compressed_strain(self) -> float | None:
        return None


@dataclass(frozen=True)
class LennardJones(Potential):
    """U = (r^-6 - 1)^2/72, which is (r^-12 - 2 r^-6 + 1)/72."""

    name = "lj"
    smooth = True
    force_kernel = staticmethod(lj_force)
    strain_min = -1.0
    dissociation = 1.0 / 72.0

    def energy(self, strain: ArrayLike) -> Array:
        """Return expm1(-6 log1p(s))^2/72."""
        return np.square(np.expm1(-6.0 * np.log1p(strain))) / 72.0

    def lammps_energy(self, strain: str) -> str:
        """Return the formula of U."""
        return f"(1.0-(1.0+{strain})^-6)^2/72.0"

    def curvature(self, strain: ArrayLike) -> Array:
        """Return (13 r^-14 - 7 r^-8)/6."""
        r = 1.0 + np.asarray(strain, dtype=float)
        return (13.0 * r**-14.0 - 7.0 * r**-8.0) / 6.0

    @property
    def convex_strain(self) -> float:
        """The inflection at r^6 = 13/7."""
        return (13.0 / 7.0) ** (1.0 / 6.0) - 1.0


@dataclass(frozen=True)
class Toda(Potential):
    """U = (exp(-b s) - 1 + b s)/b^2 with b > 0."""

    b: float = 10.0

    name = "toda"
    smooth = True
    force_kernel = staticmethod(toda_force)

    def __post_init__(self) -> None:
        """Refuse a b that is not a positive number, or whose square is none."""
        if not _SMALLEST <= self.b <= _LARGEST:
            raise PotentialError(
                f"toda_b is {self.b!r}; expected a positive number from {_SMALLEST:g} to "
                f"{_LARGEST:g}, such as 10"
            )

    @property
    def parameters(self) -> TodaParameters:
        """Of the kernel: b."""
        return TodaParameters(float(self.b))

    def energy(self, strain: ArrayLike) -> Array:
        """Return (expm1(-b s) + b s)/b^2."""
        return expm1_minus_x(-self.b * np.asarray(strain, dtype=float)) / self.b**2

    def lammps_energy(self, strain: str) -> str:
        """Return the formula of U."""
        return f"(exp(-{self.b!r}*{strain})-1.0+{self.b!r}*{strain})/{self.b**2!r}"

    def curvature(self, strain: ArrayLike) -> Array:
        """Return exp(-b s)."""
        return np.exp(-self.b * np.asarray(strain, dtype=float))

    def _find_compressed_strain(self) -> float | None:
        """Scale the root at b = 1: U(s; b) = U(b s; 1)/b^2."""
        if self.b == 1.0:
            return super()._find_compressed_strain()
        root = Toda(1.0)._find_compressed_strain()
        return None if root is None else root / self.b


@dataclass(frozen=True)
class Morse(Potential):
    """U = (1 - exp(-a s))^2/(2 a^2) with a > 0; at zero length it is finite."""

    a: float = 6.0

    name = "morse"
    smooth = True
    force_kernel = staticmethod(morse_force)

    def __post_init__(self) -> None:
        """Refuse an a that is not a positive number, or whose square is none."""
        if not _SMALLEST <= self.a <= _LARGEST:
            raise PotentialError(
                f"morse_a is {self.a!r}; expected a positive number from {_SMALLEST:g} to "
                f"{_LARGEST:g}, such as 6"
            )

    @property
    def parameters(self) -> MorseParameters:
        """Of the kernel: a."""
        return MorseParameters(float(self.a))

    @property
    def dissociation(self) -> float:  # type: ignore[override]
        """The depth D = 1/(2 a^2)."""
        return 0.5 / self.a**2

    def energy(self, strain: ArrayLike) -> Array:
        """Return expm1(-a s)^2/(2 a^2)."""
        return np.square(np.expm1(-self.a * np.asarray(strain, dtype=float))) * self.dissociation

    def lammps_energy(self, strain: str) -> str:
        """Return the formula of U."""
        return f"(1.0-exp(-{self.a!r}*{strain}))^2/{2.0 * self.a**2!r}"

    def curvature(self, strain: ArrayLike) -> Array:
        """Return e^-as (2 e^-as - 1)."""
        decay = np.exp(-self.a * np.asarray(strain, dtype=float))
        return decay * (2.0 * decay - 1.0)

    @property
    def convex_strain(self) -> float:
        """The inflection, ln(2)/a."""
        return math.log(2.0) / self.a

    def _find_compressed_strain(self) -> float | None:
        """Scale the root at a = 1: U(s; a) = U(a s; 1)/a^2."""
        if self.a == 1.0:
            return super()._find_compressed_strain()
        root = Morse(1.0)._find_compressed_strain()
        return None if root is None else root / self.a


@dataclass(frozen=True)
class Logarithmic(Potential):
    """U = s - ln(1 + s)."""

    name = "log"
    smooth = True
    force_kernel = staticmethod(log_force)
    strain_min = -1.0

    @property
    def log_length(self) -> LogLength:
        """U = r - 1 - ln r = e^y - 1 - y at y = ln r."""
        return LogLength(log_force_of_log_length, expm1_minus_x)

    def energy(self, strain: ArrayLike) -> Array:
        """Return s - log1p(s)."""
        return x_minus_log1p(strain)

    def lammps_energy(self, strain: str) -> str:
        """Return the formula of U."""
        return f"{strain}-ln(1.0+{strain})"

    def curvature(self, strain: ArrayLike) -> Array:
        """Return r^-2."""
        return (1.0 + np.asarray(strain, dtype=float)) ** -2.0


@dataclass(frozen=True)
class Power(Potential):
    """U = s^2/2 + c s^order; c > 0 for even order, c < 0 for odd order."""

    order: int
    c: float

    name = "power"
    smooth = True

    def __post_init__(self) -> None:
        """Refuse orders below 3 and the sign of c that softens compression."""
        if self.order < 3:
            raise PotentialError(f"power_order is {self.order}; expected an integer of 3 or more")
        sign, word = (1, "positive") if self.order % 2 == 0 else (-1, "negative")
        if not _SMALLEST <= self.c * sign <= _LARGEST:
            raise PotentialError(
                f"power_c is {self.c!r}; order {self.order} needs a {word} number, such as "
                f"{sign}.0, so that compression stiffens the bond (and from {_SMALLEST:g} to "
                f"{_LARGEST:g} in size)"
            )

    @property
    def force_kernel(self) -> Callable:
        """The kernel of this order."""
        return power_force(int(self.order))

    @property
    def parameters(self) -> PowerParameters:
        """Of the kernel, which knows the order: c."""
        return PowerParameters(float(self.c))

    @property
    def anharmonic_order(self) -> int | None:
        """The order itself."""
        return self.order

    def energy(self, strain: ArrayLike) -> Array:
        """Return s^2 (1/2 + c s^(order - 2))."""
        s = np.asarray(strain, dtype=float)
        return s * s * (0.5 + self.c * s ** (self.order - 2))

    def lammps_energy(self, strain: str) -> str:
        """Return the formula of U."""
        return f"{strain}*{strain}*(0.5+({self.c!r})*{strain}^{self.order - 2})"

    def curvature(self, strain: ArrayLike) -> Array:
        """Return 1 + order (order - 1) c s^(order - 2)."""
        s = np.asarray(strain, dtype=float)
        return 1.0 + self.order * (self.order - 1) * self.c * s ** (self.order - 2)

    @property
    def convex_strain(self) -> float:
        """Odd orders soften when stretched: U'' = 0 here."""
        if self.order % 2 == 0:
            return math.inf
        return (-self.order * (self.order - 1) * self.c) ** (-1.0 / (self.order - 2))

    @property
    def barrier_strain(self) -> float:
        """Strain at which a stretched bond of odd order is pulled no further back: U' = 0."""
        if self.order % 2 == 0:
            return math.inf
        return (-self.order * self.c) ** (-1.0 / (self.order - 2))

    def _find_compressed_strain(self) -> float | None:
        """Solve |c| |s|^(order - 2) = 1/2 in closed form."""
        return -((2.0 * abs(self.c)) ** (-1.0 / (self.order - 2)))


NAMED_POTENTIALS: dict[str, type[Potential]] = {
    cls.name: cls for cls in (Harmonic, LennardJones, Toda, Morse, Logarithmic, Power)
}
