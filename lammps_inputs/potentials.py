"""Bond potentials U(r) as functions of the strain s = r - 1: one class each, used by everything."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import ClassVar

import numpy as np

from lammps_inputs.errors import PotentialError
from lammps_inputs.series import expm1_minus_x, x_minus_log1p

# Force kernels: -dU/dr as a function of the strain and two parameters. They use only arithmetic
# and NumPy functions that a compiler for scalars also knows, so that the same text serves arrays
# here and compiled loops in the integrators.


def harmonic_force(strain, _p, _q):
    """Return -s."""
    return -strain


def lj_force(strain, _p, _q):
    """
    Return (r^-13 - r^-7)/6 with the root at r = 1 divided out.

    With w = 1/r, w - 1 = -s w exactly and w^6 - 1 = (w - 1)(1 + w)(1 + w^2 + w^4), so that
    nothing cancels: the force is -s w^8 (1 + w)(1 + w^2 + w^4)/6.
    """
    w = 1.0 / (1.0 + strain)
    w2 = w * w
    w4 = w2 * w2
    return (strain * (1.0 + w) * (1.0 + w2 * (1.0 + w2))) * ((w4 * w4) * (-1.0 / 6.0))


# exp(x) - 1 of :func:`toda_force`: 1/ln 2; ln 2 in two parts, of which the first has few bits; a
# number to which doubles can be added only rounded to integers; 1/2! to 1/13!, after which the
# series is exact to 2e-17 up to ln(2)/2.
_PER_LN_2 = 1.4426950408889634
_LN_2, _LN_2_REST = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_TO_INTEGER = 1.5 * 2.0**52
_A2, _A3, _A4, _A5, _A6, _A7, _A8, _A9, _A10, _A11, _A12, _A13 = (
    1.0 / math.factorial(k) for k in range(2, 14)
)


def toda_force(strain, b, _q):
    """
    Return (exp(-b s) - 1)/b to an epsilon or so, at any strain.

    The exponential is written out, for no compiler vectorises a call of expm1: with
    x = k ln 2 + y and abs(y) <= ln(2)/2, exp(x) - 1 = (2^k - 1) + 2^k (exp(y) - 1), where 2^k is
    made of its bits. Beyond exp(709) the force stays what it is there.
    """
    x = np.minimum(np.maximum(-b * strain, -40.0), 709.0)  # exp(-40) is no part of 1
    shifted = x * _PER_LN_2 + _TO_INTEGER
    k = shifted - _TO_INTEGER
    y = (x - k * _LN_2) - k * _LN_2_REST
    high = _A8 + y * (_A9 + y * (_A10 + y * (_A11 + y * (_A12 + y * _A13))))
    rest = _A2 + y * (_A3 + y * (_A4 + y * (_A5 + y * (_A6 + y * (_A7 + y * high)))))
    bits = np.int64((np.float64(shifted).view(np.int64) + 1023) << 52)
    power_of_2 = bits.view(np.float64)
    return ((power_of_2 - 1.0) + power_of_2 * (y + y * y * rest)) / b


def log_force(strain, _p, _q):
    """Return 1/r - 1 = -s/(1 + s)."""
    return -strain / (1.0 + strain)


@cache
def power_force(order: int) -> Callable:
    """
    Return the kernel -s - order c s^(order - 1) for one order.

    To a compiler the order is then a constant, and the power a few multiplications.

    Parameters
    ----------
    order : int
        Order of the anharmonic term, 3 or more.

    Returns
    -------
    callable
        ``kernel(strain, c, order)``, which must be the same order.
    """
    exponent = order - 2

    def kernel(strain, c, _order):
        return -strain * (1.0 + order * c * strain**exponent)

    # Compiled loops are told apart by qualified names.
    kernel.__qualname__ = f"power{order}_force"
    return kernel


# Parameters whose squares and inverse squares floating point can hold.
_SMALLEST, _LARGEST = 1e-100, 1e100


class Potential(ABC):
    """
    A bond between neighbours, with natural length 1.

    Strain is s = r - 1 (positive: stretched). Energies are zero at s = 0; forces are -dU/dr
    (positive: the bond pushes its ends apart). Units: natural bond length, particle mass and, for
    the named potentials, bond stiffness are 1.

    Attributes
    ----------
    name : str
        The name used in scenes.
    strain_min, strain_max : float
        Strains must stay between these: strain_min is -1 where r > 0 is needed, -inf otherwise.
    dissociation : float
        U at infinite length; inf for a bond that cannot break.
    """

    name: str
    strain_min: float = -math.inf
    strain_max: float = math.inf
    dissociation: ClassVar[float] = math.inf

    @abstractmethod
    def energy(self, strain):
        """
        Return U as a function of the strain.

        Parameters
        ----------
        strain : array_like
            Strain s = r - 1.

        Returns
        -------
        numpy.ndarray
            Energy, zero at s = 0.
        """

    def force(self, strain):
        """
        Return -dU/dr.

        Parameters
        ----------
        strain : array_like
            Strain s = r - 1.

        Returns
        -------
        numpy.ndarray
            Force, positive where the bond is compressed.
        """
        kernel = self.force_kernel
        assert kernel is not None, "a potential without a kernel overrides force"
        return kernel(np.asarray(strain, dtype=float), *self.parameters)

    @abstractmethod
    def curvature(self, strain):
        """
        Return U''.

        Parameters
        ----------
        strain : array_like
            Strain s = r - 1.

        Returns
        -------
        numpy.ndarray
            Curvature: the local stiffness.
        """

    def lammps_energy(self, strain: str) -> str | None:
        """
        Return U as a formula for LAMMPS variables, good to their 17 digits or so.

        Parameters
        ----------
        strain : str
            Name of the variable that holds the strain.

        Returns
        -------
        str or None
            None for a bond that has no formula.
        """
        return None

    @property
    def force_kernel(self) -> Callable | None:
        """``f(strain, p, q)`` for compiled loops; None where only :meth:`force` exists."""
        return None

    @property
    def parameters(self) -> tuple[float, float]:
        """The (p, q) of the kernel."""
        return (0.0, 0.0)

    @property
    def anharmonic_order(self) -> int | None:
        """Order of the lowest anharmonic term of U at s = 0; None for harmonic or unknown."""
        return 3

    @property
    def stiffness(self) -> float:
        """U''(1): 1 for every named potential."""
        return 1.0

    @property
    def convex_strain(self) -> float:
        """Largest strain up to which U is convex; inf where it always is."""
        return math.inf

    @property
    def barrier(self) -> float:
        """Energy of the barrier beyond which U falls without bound; inf where there is none."""
        return math.inf

    @cached_property
    def compressed_root(self) -> float | None:
        """x* < 1, where U equals twice its harmonic part; None where no such length exists."""
        strain = self._find_compressed_strain()
        return None if strain is None else 1.0 + strain

    @cached_property
    def natural_speed(self) -> float | None:
        """v* = sqrt(2 U(x*)), the speed scale of the nonlinearity; None for harmonic."""
        strain = self._find_compressed_strain()
        return None if strain is None else math.sqrt(2.0 * float(self.energy(strain)))

    def _find_compressed_strain(self) -> float | None:
        """Solve U(s)/(U'' s^2) = 1 outward from the natural length; U/s^2 starts at U''/2."""
        from scipy.optimize import brentq

        def excess(strain):
            return float(self.energy(strain)) / (self.stiffness * strain * strain) - 1.0

        near = -1e-3
        while excess(near) >= 0.0 and near < -1e-100:  # a bond this steep has its root closer
            near *= 1e-3
        for _ in range(200):
            far = near * 1.1
            if far <= self.strain_min:
                far = 0.5 * (near + self.strain_min)
                if far - self.strain_min < 1e-12:
                    return None
            with np.errstate(all="ignore"):
                value = excess(far)
            if not math.isfinite(value):
                return None
            if value >= 0.0:
                return float(brentq(excess, near, far, xtol=1e-15, rtol=1e-15))
            near = far
        return None


@dataclass(frozen=True)
class Harmonic(Potential):
    """U = s^2/2."""

    name = "harmonic"
    force_kernel = staticmethod(harmonic_force)

    @property
    def anharmonic_order(self):
        """None: there is no anharmonic term."""
        return None

    def energy(self, strain):
        """Return s^2/2."""
        return 0.5 * np.square(strain)

    def lammps_energy(self, strain):
        """Return the formula of U."""
        return f"0.5*{strain}*{strain}"

    def curvature(self, strain):
        """Return 1."""
        return np.ones_like(np.asarray(strain, dtype=float))

    def _find_compressed_strain(self):
        return None


@dataclass(frozen=True)
class LennardJones(Potential):
    """U = (r^-6 - 1)^2/72, which is (r^-12 - 2 r^-6 + 1)/72."""

    name = "lj"
    force_kernel = staticmethod(lj_force)
    strain_min = -1.0
    dissociation = 1.0 / 72.0

    def energy(self, strain):
        """Return expm1(-6 log1p(s))^2/72."""
        return np.square(np.expm1(-6.0 * np.log1p(strain))) / 72.0

    def lammps_energy(self, strain):
        """Return the formula of U."""
        return f"(1.0-(1.0+{strain})^-6)^2/72.0"

    def curvature(self, strain):
        """Return (13 r^-14 - 7 r^-8)/6."""
        r = 1.0 + np.asarray(strain, dtype=float)
        return (13.0 * r**-14.0 - 7.0 * r**-8.0) / 6.0

    @property
    def convex_strain(self):
        """The inflection at r^6 = 13/7."""
        return (13.0 / 7.0) ** (1.0 / 6.0) - 1.0


@dataclass(frozen=True)
class Toda(Potential):
    """U = (exp(-b s) - 1 + b s)/b^2 with b > 0."""

    b: float = 10.0

    name = "toda"
    force_kernel = staticmethod(toda_force)

    def __post_init__(self):
        """Refuse a b that is not a positive number, or whose square is none."""
        if not _SMALLEST <= self.b <= _LARGEST:
            raise PotentialError(
                f"toda_b is {self.b!r}; expected a positive number from {_SMALLEST:g} to "
                f"{_LARGEST:g}, such as 10"
            )

    @property
    def parameters(self):
        """(b, unused)."""
        return (float(self.b), 0.0)

    def energy(self, strain):
        """Return (expm1(-b s) + b s)/b^2."""
        return expm1_minus_x(-self.b * np.asarray(strain, dtype=float)) / self.b**2

    def lammps_energy(self, strain):
        """Return the formula of U."""
        return f"(exp(-{self.b!r}*{strain})-1.0+{self.b!r}*{strain})/{self.b**2!r}"

    def curvature(self, strain):
        """Return exp(-b s)."""
        return np.exp(-self.b * np.asarray(strain, dtype=float))

    def _find_compressed_strain(self):
        """Scale the root at b = 1: U(s; b) = U(b s; 1)/b^2."""
        if self.b == 1.0:
            return super()._find_compressed_strain()
        return Toda(1.0)._find_compressed_strain() / self.b


@dataclass(frozen=True)
class Logarithmic(Potential):
    """U = s - ln(1 + s)."""

    name = "log"
    force_kernel = staticmethod(log_force)
    strain_min = -1.0

    def energy(self, strain):
        """Return s - log1p(s)."""
        return x_minus_log1p(strain)

    def lammps_energy(self, strain):
        """Return the formula of U."""
        return f"{strain}-ln(1.0+{strain})"

    def curvature(self, strain):
        """Return r^-2."""
        return (1.0 + np.asarray(strain, dtype=float)) ** -2.0


@dataclass(frozen=True)
class Power(Potential):
    """U = s^2/2 + c s^order; c > 0 for even order, c < 0 for odd order."""

    order: int
    c: float

    name = "power"

    def __post_init__(self):
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
    def force_kernel(self):
        """The kernel of this order."""
        return power_force(int(self.order))

    @property
    def parameters(self):
        """(c, order); the kernel knows the order."""
        return (float(self.c), int(self.order))

    @property
    def anharmonic_order(self):
        """The order itself."""
        return self.order

    def energy(self, strain):
        """Return s^2 (1/2 + c s^(order - 2))."""
        s = np.asarray(strain, dtype=float)
        return s * s * (0.5 + self.c * s ** (self.order - 2))

    def lammps_energy(self, strain):
        """Return the formula of U."""
        return f"{strain}*{strain}*(0.5+({self.c!r})*{strain}^{self.order - 2})"

    def curvature(self, strain):
        """Return 1 + order (order - 1) c s^(order - 2)."""
        s = np.asarray(strain, dtype=float)
        return 1.0 + self.order * (self.order - 1) * self.c * s ** (self.order - 2)

    @property
    def convex_strain(self):
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

    @property
    def barrier(self):
        """U at the barrier strain."""
        strain = self.barrier_strain
        return math.inf if math.isinf(strain) else float(self.energy(strain))

    def _find_compressed_strain(self):
        """Solve |c| |s|^(order - 2) = 1/2 in closed form."""
        return -((2.0 * abs(self.c)) ** (-1.0 / (self.order - 2)))


class UserBond(Potential):
    """
    A bond given by a user's own functions of the strain.

    Parameters
    ----------
    energy, force : callable
        U(s) and -dU/dr(s), both of arrays.
    name : str
        A label for results.
    strain_min, strain_max : float
        Strains at which the functions may be asked lie between these.

    Raises
    ------
    PotentialError
        If the force does not vanish at natural length or the bond is not stable there.
    """

    anharmonic_order = None
    _STEP = 1e-5  # central difference of the force: error of order step^2 = 1e-10

    def __init__(self, energy, force, name="user", strain_min=-1.0, strain_max=math.inf):
        self.name = name
        self.strain_max = strain_max
        self._energy = energy
        self._force = force
        self.strain_min = strain_min
        self._offset = float(energy(np.array(0.0)))
        at_rest = float(force(np.array(0.0)))
        self._stiffness = float(self.curvature(0.0))
        if not abs(at_rest) <= 1e-9 * abs(self._stiffness):
            raise PotentialError(
                f"bond '{name}' pushes with {at_rest:g} at length 1; expected no force there: "
                "scale lengths so that the natural bond length is 1"
            )
        if not self._stiffness > 0:
            raise PotentialError(
                f"bond '{name}' has curvature {self._stiffness:g} at length 1; expected a stable "
                "bond, with positive curvature there"
            )

    def energy(self, strain):
        """Return the user's energy, shifted to zero at s = 0."""
        return np.asarray(self._energy(np.asarray(strain, dtype=float)), dtype=float) - self._offset

    def force(self, strain):
        """Return the user's force."""
        return np.asarray(self._force(np.asarray(strain, dtype=float)), dtype=float)

    def curvature(self, strain):
        """Return -dF/ds by a central difference, one-sided at the ends of the range."""
        s = np.asarray(strain, dtype=float)
        below = np.maximum(s - self._STEP, self.strain_min)
        above = np.minimum(s + self._STEP, self.strain_max)
        return -(self.force(above) - self.force(below)) / (above - below)

    @property
    def stiffness(self):
        """U''(1), from the user's force."""
        return self._stiffness


NAMED_POTENTIALS: dict[str, type[Potential]] = {
    cls.name: cls for cls in (Harmonic, LennardJones, Toda, Logarithmic, Power)
}
