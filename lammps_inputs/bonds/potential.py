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

# A scan has this many strains. Two scans narrow a range to less than a thousandth.
_GRID = 64
# This many halvings narrow a range of logarithms down to rounding.
_HALVINGS = 60


@dataclass(frozen=True)
class LogLength:
    """Bond that can shrink without bound, as a function of y = ln r."""

    kernel: Callable  #: ``kernel(y, parameters)``, which returns -dU/dr and 1/r in compiled loops.
    energy: Callable  #: Function that returns U for an array of y.


class Potential(ABC):
    """
    Bond between neighbours, with the natural length as unit of length.

    Strain is s = r - 1 (positive: stretched). Energies are zero at s = 0; forces are -dU/dr
    (positive: the bond pushes its ends apart). Units: natural bond length, particle mass and, for
    the named potentials, bond stiffness are 1.
    """

    name: str  #: The name used in scenes.
    #: Smallest strain: -1 if the bond needs r > 0, else -inf.
    strain_min: float = -math.inf
    strain_max: float = math.inf  #: Largest strain.
    dissociation: float = math.inf  #: U at infinite length; inf for a bond that cannot break.
    #: Whether the force is known to have derivatives of every order.
    smooth: ClassVar[bool] = False
    #: Whether `energy` gives the same digits for one number as for an array.
    rounds_alike: ClassVar[bool] = False
    is_harmonic: ClassVar[bool] = False  #: Whether U = s^2/2, so that a chain is a sum of modes.
    #: Whether U grows faster than any power of the compression. Such bonds act like hard spheres at
    #: high speeds.
    becomes_hard: ClassVar[bool] = False
    #: Whether the chain is a column of beads: the bond has no force in tension and no stiffness at
    #: rest.
    only_pushes: ClassVar[bool] = False
    #: Constant that is subtracted from the energies; its rounding remains in them.
    energy_offset: float = 0.0
    #: Order of the lowest anharmonic term of U at s = 0; None for harmonic or unknown.
    anharmonic_order: int | None = 3
    stiffness: float = 1.0  #: U''(1): 1 for every named potential.
    #: Length of a bond at rest in the user's own units; the engines count it as 1.
    natural_length: float = 1.0
    convex_strain: float = math.inf  #: Largest strain up to which U is convex; inf for all.
    #: Strain beyond which U falls without bound; inf without such a barrier.
    barrier_strain: float = math.inf
    #: ``f(strain, parameters)``, which returns -dU/dr in compiled loops; None if only the method
    #: exists.
    force_kernel: Callable | None = None
    #: ``f(strain, parameters)``, which returns U'' in compiled loops, or None.
    curvature_kernel: Callable | None = None
    #: Parameters of the kernels, as a NamedTuple.
    parameters: tuple[Any, ...] = NoParameters()
    #: The force of a user, ``f(strain)``, which may be compiled if there is no kernel.
    users_force: Callable | None = None
    #: Formula of U for LAMMPS, accurate to about 17 digits, with the strain ``{s}`` and the
    #: ``{bond}``; None for a bond without a formula.
    lammps_formula: ClassVar[str | None] = None
    #: The bond as a function of ln r, if it gets too short for strains.
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
        """Return the stiffness that sets the speed of sound in a chain whose bonds hold energies.

        The stiffness is U'' at rest, unless U'' is known only from differences of the force.
        """
        return self.stiffness

    def scale_stiffness(self, energy: float) -> float:
        """Return the stiffness that sets the scale of times: U'' at rest, if it is not 0."""
        return self.sound_stiffness(energy) if self.only_pushes else self.stiffness

    @property
    def is_tabulated(self) -> bool:
        """Whether LAMMPS reads the force from a table, because it has no such bond style."""
        return not (self.is_harmonic or self.only_pushes)

    def as_keys(self) -> dict[str, Any]:
        """Return the parameters that decide the bond, by their keys in scenes."""
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
        Strain at which particles would pass through each other, or where the bond's data end.

        It is -inf if particles may pass: for harmonic bonds, and for a user's bond without limits
        of strain or a known anharmonic term. A result then says whether particles passed each
        other.
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
        """Length x* < 1 at which U is twice its harmonic part; None if there is no such length."""
        strain = self._find_compressed_strain()
        return None if strain is None else 1.0 + strain

    @cached_property
    def natural_speed(self) -> float | None:
        """
        Speed scale of the nonlinearity, v* = sqrt(2 U(x*)); None for harmonic bonds.

        The value is rounded to 13 digits, because further digits depend on the processor. A scene
        with a speed in units of v*, and its key in a store, would otherwise depend on the
        processor.
        """
        strain = self._find_compressed_strain()
        if strain is None:
            return None
        return float(f"{math.sqrt(2.0 * float(self.energy(strain))):.12e}")

    def _find_compressed_strain(self) -> float | None:
        """Solve U(s)/(U'' s^2) = 1, searching from rest, where the ratio is 1/2."""

        def excess(strain: float) -> float:
            return float(self.energy(strain)) / (self.stiffness * strain * strain) - 1.0

        near = -1e-3
        # the root of such a steep bond is closer to rest
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
                return _halved(lambda strain: excess(strain) < 0.0, near, far)[1]
            near = far
        return None

    def distance_at(self, energy: float, side: float, end: float = math.inf) -> float:
        """
        Return the distance from rest at which the bond first has an energy, to the last bit.

        `side` is -1 for compressed bonds and 1 for stretched bonds. Returns `end` if the energy is
        not reached before it.
        """
        holds = self._holds_at_most(energy, side)
        far = math.sqrt(2.0 * energy / self.stiffness) * np.geomspace(1e-3, 1e9, 4000)
        far = np.append(far[far < end], end) if end < far[-1] else far
        above = ~holds(far)
        if not np.any(above):
            return end
        first = int(np.argmax(above))
        inner, outer = float(far[first - 1]) if first else 0.0, float(far[first])
        return _halved(lambda distance: bool(holds(np.array(distance))), inner, outer)[0]

    def compressed_strain(self, energy: float) -> float:
        """
        Return the negative strain at which the compressed bond has an energy.

        If no strain has this energy, the result is just above -1, where particles would touch.
        """
        return float(self.compressed_strains(np.array([energy]))[0])

    def compressed_strains(self, energies: Array) -> Array:
        """Return the compressed strains for many energies, of shape (energies,)."""
        floor = max(self.strain_min, -1.0)
        # One energy needs no arrays if scalars round as arrays do.
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
        # The logarithm of the length is halved, because log bonds get as short as exp(-energy).
        with np.errstate(all="ignore"):
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                low, high = keep(self.energy(floor * -expm1(middle)), asked, low, middle, high)
        return floor * -_expm1(np.atleast_1d(high))

    def strain_range(self, energy: float) -> tuple[float, float]:
        """
        Return the range of strains in which the bond has at most an energy.

        The range is rounded outward by less than a thousandth. The upper end is inf if the energy
        breaks the bond.
        """
        shortest = -self._outermost(energy, -1.0, -self.strain_min)
        if energy >= self.dissociation:
            return shortest, math.inf
        return shortest, min(self._outermost(energy, 1.0, self.strain_max), self.strain_max)

    def _outermost(self, energy: float, side: float, end: float) -> float:
        """Return the approximate distance at which U first exceeds an energy, in a few calls."""
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
        """Return whether U is at most `energy` at each of some distances from rest."""

        def holds(distances: Array) -> NDArray[np.bool_]:
            with np.errstate(all="ignore"):
                return np.asarray(self.energy(side * distances), dtype=float) <= energy

        return holds


def stiffness_of(bond: Potential | None) -> float:
    """Return U'' at rest; 1 for an unknown bond."""
    return 1.0 if bond is None else bond.stiffness


def _halved(holds: Callable[[float], bool], inside: float, outside: float) -> tuple[float, float]:
    """Find by halving the two adjacent numbers between which a condition ceases to hold."""
    # SciPy's root finders need fewer steps, but take longer to import than a run takes.
    while (middle := 0.5 * (inside + outside)) not in (inside, outside):
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside, outside


def _keep_half(
    held: Any, asked: float, low: float, middle: float, high: float
) -> tuple[float, float]:
    """Return the half of an interval in which the energy `held` at its middle passes `asked`."""
    held = float(held)
    return (middle, high) if held > asked or not math.isfinite(held) else (low, middle)


def _keep_halves(
    held: Any, asked: Array, low: Array, middle: Array, high: Array
) -> tuple[Array, Array]:
    """Return the halves of many intervals, as `_keep_half` does for one."""
    beyond = (held > asked) | ~np.isfinite(held)
    return np.where(beyond, middle, low), np.where(beyond, high, middle)


def _expm1(exponents: Array) -> Array:
    # NumPy's exp rounds differently from the system's, with which stored numbers were computed.
    return np.array([math.expm1(exponent) for exponent in exponents.tolist()])
