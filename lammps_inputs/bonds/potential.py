"""Define the interface of bonds: energy, force and curvature as functions of the strain."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.check import find_kinks
from chaincor.lammps_inputs.contacts.contact_law import ContactLaw, NoParameters

# Number of strains in a scan. Two scans narrow a range to less than a thousandth.
_GRID = 64
# Number of halvings that narrow a range of logarithms down to rounding.
_HALVINGS = 60


@dataclass(frozen=True)
class LogLength:
    """Bond whose length can approach zero, as a function of y = ln r."""

    kernel: Callable  #: ``kernel(y, parameters)``, which returns -dU/dr and 1/r in compiled loops.
    energy: Callable  #: Function that returns U for an array of y.


class Potential(ABC):
    """
    Bond between neighbours, with its natural length as the unit of length.

    The strain is s = r - 1, positive if the bond is stretched. Energies are zero at s = 0. Forces
    are -dU/dr, positive if the bond pushes its ends apart. Natural bond length and particle mass
    are 1; the bond stiffness is 1 for the named potentials.
    """

    name: str  #: Name in scenes.
    #: Smallest strain: -1 if U requires r > 0, otherwise -inf.
    strain_min: float = -math.inf
    #: Largest strain at which the bond has a force; inf without a limit.
    strain_max: float = math.inf
    dissociation: float = math.inf  #: U at infinite length; inf for a bond that cannot break.
    #: Whether the force is known to have derivatives of every order.
    smooth: ClassVar[bool] = False
    #: Whether `energy` has the same rounding for a single number as for an array.
    rounds_alike: ClassVar[bool] = False
    is_harmonic: ClassVar[bool] = False  #: Whether U = s^2/2. Chains then have normal modes.
    #: Whether U grows faster than any power of the compression. Such bonds act like hard spheres at
    #: high speeds.
    becomes_hard: ClassVar[bool] = False
    #: Whether the chain is a column of beads. The bond has no force in tension and no stiffness at
    #: s = 0.
    only_pushes: ClassVar[bool] = False
    #: Constant that is subtracted from the energies, and leaves its rounding error in them.
    energy_offset: float = 0.0
    #: Order of the lowest anharmonic term of U at s = 0; None if it is unknown or U is harmonic.
    anharmonic_order: int | None = 3
    stiffness: float = 1.0  #: U''(1): 1 for every named potential.
    #: Natural length in the user's units; it is 1 in the engines.
    natural_length: float = 1.0
    convex_strain: float = (
        math.inf
    )  #: Largest strain up to which U is convex; inf if U is convex everywhere.
    #: Strain at a barrier, beyond which U falls without bound; inf without a barrier.
    barrier_strain: float = math.inf
    #: ``f(strain, parameters)``, which returns -dU/dr in compiled loops. It is None if there is
    #: only the method `force`.
    force_kernel: Callable | None = None
    #: ``f(strain, parameters)``, which returns U'' in compiled loops. It is None if there is only
    #: the method `curvature`.
    curvature_kernel: Callable | None = None
    #: Parameters of the kernels, as a NamedTuple.
    parameters: tuple[Any, ...] = NoParameters()
    #: Force function of a user, ``f(strain)``, which may be compiled if there is no kernel.
    users_force: Callable | None = None
    #: Formula of U for LAMMPS, accurate to about 17 digits; None if there is none. It contains
    #: ``{s}`` for the strain, and parameters of the ``{bond}``.
    lammps_formula: ClassVar[str | None] = None
    #: The bond as a function of ln r; None if lengths never become too short to be stored as
    #: strains.
    log_length: LogLength | None = None

    @abstractmethod
    def energy(self, strain: ArrayLike) -> Array:
        """Return U at given strains; U is 0 at s = 0."""

    def force(self, strain: ArrayLike) -> Array:
        """Return the force -dU/dr at given strains, positive in compression."""
        kernel = self.force_kernel
        assert kernel is not None, "a potential without a kernel overrides force"
        return kernel(np.asarray(strain, dtype=float), self.parameters)

    def curvature(self, strain: ArrayLike) -> Array:
        """Return the local stiffness U'' at given strains."""
        kernel = self.curvature_kernel
        assert kernel is not None, "a potential without a kernel overrides curvature"
        return kernel(np.asarray(strain, dtype=float), self.parameters)

    def sound_stiffness(self, _energy: float) -> float:
        """Return the stiffness that determines the speed of sound in a chain.

        The result is U'' at s = 0. If U'' is known only from differences of the force, the result
        may depend on the energy stored in bonds.
        """
        return self.stiffness

    def scale_stiffness(self, energy: float) -> float:
        """Return the stiffness that determines the scale of times: U'' at s = 0, if it is not 0."""
        return self.sound_stiffness(energy) if self.only_pushes else self.stiffness

    @property
    def is_tabulated(self) -> bool:
        """Whether LAMMPS reads the force from a table, because it has no such bond style."""
        return not (self.is_harmonic or self.only_pushes)

    def as_keys(self) -> dict[str, Any]:
        """Return the parameters that determine the bond, by their keys in scenes."""
        return {}

    @property
    def contact(self) -> ContactLaw | None:
        """Contact law of two bodies with these bonds; None if the bonds do not determine it."""
        return None

    @cached_property
    def kinks(self) -> tuple[float, ...]:
        """Strains at which the stiffness jumps, found by search if the force may have kinks."""
        return () if self.smooth else find_kinks(self)

    @property
    def crossing_strain(self) -> float:
        """
        Strain at which particles would pass through each other, or at which the bond's data end.

        The strain is -inf if particles may pass each other: for harmonic bonds, and for bonds of
        users with neither a smallest strain nor a known anharmonic term. A result then says whether
        particles passed each other.
        """
        free = self.anharmonic_order is None and self.strain_min == -math.inf
        return -math.inf if free else max(-1.0, self.strain_min)

    @property
    def barrier(self) -> float:
        """U at the barrier strain; inf without a barrier."""
        strain = self.barrier_strain
        return math.inf if math.isinf(strain) else float(self.energy(strain))

    @cached_property
    def compressed_root(self) -> float | None:
        """Length x* < 1 at which U is twice its harmonic part; None if U never is."""
        strain = self._find_compressed_strain()
        return None if strain is None else 1.0 + strain

    @cached_property
    def natural_speed(self) -> float | None:
        """
        Speed scale of the nonlinearity, v* = sqrt(2 U(x*)); None for harmonic bonds.

        v* is rounded to 13 digits, because further digits depend on the processor. Otherwise a
        scene with a speed in units of v* would also depend on the processor, and so would its key
        in a store.
        """
        strain = self._find_compressed_strain()
        if strain is None:
            return None
        return float(f"{math.sqrt(2.0 * float(self.energy(strain))):.12e}")

    def _find_compressed_strain(self) -> float | None:
        """Solve U(s)/(U'' s^2) = 1. The search begins at s = 0, where the ratio is 1/2."""

        def excess(strain: float) -> float:
            return float(self.energy(strain)) / (self.stiffness * strain * strain) - 1.0

        near = -1e-3
        # if the ratio is already too large at this strain, the root is closer to s = 0
        while excess(near) >= 0.0 and near < -1e-100:
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
                return halve_interval(lambda strain: excess(strain) < 0.0, near, far)[1]
            near = far
        return None

    def distance_at(self, energy: float, side: float, end: float = math.inf) -> float:
        """
        Return the smallest absolute strain at which U has a given value, to the last bit.

        `side` is -1 for compressed bonds and 1 for stretched bonds. Returns `end` if the bond does
        not reach the energy before `end`.
        """
        holds = self._holds_at_most(energy, side)
        far = math.sqrt(2.0 * energy / self.stiffness) * np.geomspace(1e-3, 1e9, 4000)
        far = np.append(far[far < end], end) if end < far[-1] else far
        above = ~holds(far)
        if not np.any(above):
            return end
        first = int(np.argmax(above))
        inner, outer = float(far[first - 1]) if first else 0.0, float(far[first])
        return halve_interval(lambda distance: bool(holds(np.array(distance))), inner, outer)[0]

    def compressed_strain(self, energy: float) -> float:
        """
        Return the negative strain at which the bond has a given energy.

        If no strain has this energy, the result is just above -1, at which particles would touch.
        """
        return float(self.compressed_strains(np.array([energy]))[0])

    def compressed_strains(self, energies: Array) -> Array:
        """Return the negative strains for many energies, of shape (energies,)."""
        floor = max(self.strain_min, -1.0)
        # A single energy needs no arrays if scalars are rounded like arrays.
        asked: Any
        low: Any
        high: Any
        expm1: Callable
        keep: Callable
        if len(energies) == 1 and self.rounds_alike:
            asked, low, high, expm1, keep = float(energies[0]), -700.0, 0.0, math.expm1, _keep_half
        else:
            asked, low, high = energies, np.full(len(energies), -700.0), np.zeros(len(energies))
            expm1, keep = _expm1, _keep_halves
        # Bisect the logarithm of the length and not the length, because log bonds become as short
        # as exp(-energy).
        with np.errstate(all="ignore"):
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                low, high = keep(self.energy(floor * -expm1(middle)), asked, low, middle, high)
        return floor * -_expm1(np.atleast_1d(high))

    def strain_range(self, energy: float) -> tuple[float, float]:
        """
        Return the range of strains in which the bond has at most a given energy.

        The range is rounded outward by less than a thousandth. The upper end is inf if the energy
        breaks the bond.
        """
        shortest = -self._outermost(energy, -1.0, -self.strain_min)
        if energy >= self.dissociation:
            return shortest, math.inf
        return shortest, min(self._outermost(energy, 1.0, self.strain_max), self.strain_max)

    def _outermost(self, energy: float, side: float, end: float) -> float:
        """Return the approximate absolute strain at which U first exceeds an energy."""
        holds = self._holds_at_most(energy, side)
        inner, outer = 0.0, 1e-3 * math.sqrt(2.0 * energy / self.stiffness)
        for _ in range(_GRID):
            if outer >= end:
                outer = end
                break
            if not holds(np.array(outer)):
                break
            inner, outer = outer, 2.0 * outer
        for _ in range(2):
            distances = np.linspace(inner, outer, _GRID)
            above = ~holds(distances)
            above[-1] = True
            first = int(np.argmax(above))
            inner, outer = float(distances[max(first - 1, 0)]), float(distances[first])
        return outer

    def _holds_at_most(self, energy: float, side: float) -> Callable[[Array], NDArray[np.bool_]]:
        """Return a function that tells for absolute strains whether U is at most `energy`."""

        def holds(distances: Array) -> NDArray[np.bool_]:
            with np.errstate(all="ignore"):
                return np.asarray(self.energy(side * distances), dtype=float) <= energy

        return holds


def stiffness_of(bond: Potential | None) -> float:
    """Return U'' at s = 0; 1 for an unknown bond."""
    return 1.0 if bond is None else bond.stiffness


def halve_interval(
    holds: Callable[[float], bool], inside: float, outside: float
) -> tuple[float, float]:
    """Find by bisection the two adjacent floats between which a condition becomes false."""
    # SciPy's root finders need fewer steps, but importing SciPy takes longer than a run.
    while (middle := 0.5 * (inside + outside)) not in (inside, outside):
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside, outside


def _keep_half(
    held: Any, asked: float, low: float, middle: float, high: float
) -> tuple[float, float]:
    """Return the half that contains the energy `asked`; `held` is the energy at the middle."""
    held = float(held)
    return (middle, high) if held > asked or not math.isfinite(held) else (low, middle)


def _keep_halves(
    held: Any, asked: Array, low: Array, middle: Array, high: Array
) -> tuple[Array, Array]:
    """Return the halves of many intervals, like `_keep_half`."""
    beyond = (held > asked) | ~np.isfinite(held)
    return np.where(beyond, middle, low), np.where(beyond, high, middle)


def _expm1(exponents: Array) -> Array:
    # NumPy's exp is rounded differently from the system's exp, with which stored results were
    # computed.
    return np.array([math.expm1(exponent) for exponent in exponents.tolist()])
