"""Interface of a bond potential: energy, force and curvature as functions of the strain."""

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

# Strains of one scan, of which two narrow a range down to less than a thousandth.
_GRID = 64
# Halvings of a range of logarithms, down to rounding.
_HALVINGS = 60


@dataclass(frozen=True)
class LogLength:
    """Bond that can shrink without bound, as a function of y = ln r."""

    kernel: Callable  #: ``kernel(y, parameters)``: -dU/dr and 1/r, for compiled loops.
    energy: Callable  #: U of an array of y.


class Potential(ABC):
    """
    Bond between neighbours, with the natural length as unit of length.

    Strain is s = r - 1 (positive: stretched). Energies are zero at s = 0; forces are -dU/dr
    (positive: the bond pushes its ends apart). Units: natural bond length, particle mass and, for
    the named potentials, bond stiffness are 1.
    """

    name: str  #: The name used in scenes.
    #: Strains must stay between these: strain_min is -1 where r > 0 is needed, -inf otherwise.
    strain_min: float = -math.inf
    strain_max: float = math.inf  #: Largest strain.
    dissociation: float = math.inf  #: U at infinite length; inf for a bond that cannot break.
    #: Whether the force is known to have derivatives of every order.
    smooth: ClassVar[bool] = False
    #: Whether `energy` gives a number and an array of numbers the same digits.
    rounds_alike: ClassVar[bool] = False
    is_harmonic: ClassVar[bool] = False  #: Whether U = s^2/2, so that a chain is a sum of modes.
    #: Whether U is known to grow faster than any power of the compression: such bonds act like hard
    #: spheres at high speeds.
    becomes_hard: ClassVar[bool] = False
    #: Whether the bond holds nothing together and has no stiffness at rest: a chain of beads.
    only_pushes: ClassVar[bool] = False
    #: Constant taken off the energies, whose rounding it leaves in them.
    energy_offset: float = 0.0
    #: Order of the lowest anharmonic term of U at s = 0; None for harmonic or unknown.
    anharmonic_order: int | None = 3
    stiffness: float = 1.0  #: U''(1): 1 for every named potential.
    #: Length of a bond at rest in the user's own units; the engines count it as 1.
    natural_length: float = 1.0
    convex_strain: float = math.inf  #: Largest strain up to which U is convex; inf for all.
    #: Strain beyond which U falls without bound; inf where there is no such barrier.
    barrier_strain: float = math.inf
    #: ``f(strain, parameters)`` for compiled loops, of -dU/dr and of U''; None where only the
    #: methods exist.
    force_kernel: Callable | None = None
    #: ``f(strain, parameters)`` of U'' for compiled loops, or None.
    curvature_kernel: Callable | None = None
    #: Parameters of the kernels, as a NamedTuple.
    parameters: tuple[Any, ...] = NoParameters()
    #: A user's own ``f(strain)``, which a compiler may try where there is no kernel.
    users_force: Callable | None = None
    #: U for LAMMPS, good to 17 digits or so, of the strain ``{s}`` and the ``{bond}``; None for a
    #: bond without formula.
    lammps_formula: ClassVar[str | None] = None
    #: The bond as a function of ln r, if it gets too short for strains.
    log_length: LogLength | None = None

    @abstractmethod
    def energy(self, strain: ArrayLike) -> Array:
        """Return U of strains, zero at s = 0."""

    def force(self, strain: ArrayLike) -> Array:
        """Return -dU/dr of strains, positive where the bond is compressed."""
        kernel = self.force_kernel
        assert kernel is not None, "a potential without a kernel overrides force"
        return kernel(np.asarray(strain, dtype=float), self.parameters)

    def curvature(self, strain: ArrayLike) -> Array:
        """Return U'', the local stiffness, of strains."""
        kernel = self.curvature_kernel
        assert kernel is not None, "a potential without a kernel overrides curvature"
        return kernel(np.asarray(strain, dtype=float), self.parameters)

    def sound_stiffness(self, _energy: float) -> float:
        """Return the stiffness that sets the speed of sound in a chain whose bonds hold energies.

        That is U'' at rest, unless a bond knows that only by a difference.
        """
        return self.stiffness

    def scale_stiffness(self, energy: float) -> float:
        """Return the stiffness that sets the scale of times: U'' at rest, unless there is none."""
        return self.sound_stiffness(energy) if self.only_pushes else self.stiffness

    @property
    def is_tabulated(self) -> bool:
        """Whether LAMMPS has its force in a table, and not as a law of its own."""
        return not (self.is_harmonic or self.only_pushes)

    def as_keys(self) -> dict[str, Any]:
        """Return what decides a bond that a scene names: its parameters by their keys there."""
        return {}

    @property
    def contact(self) -> ContactLaw | None:
        """The contact law of two bodies of such particles; None where bonds say nothing of it."""
        return None

    @cached_property
    def kinks(self) -> tuple[float, ...]:
        """Strains at which the stiffness jumps, found by looking where formulas are not known."""
        return () if self.smooth else find_kinks(self)

    @property
    def crossing_strain(self) -> float:
        """
        Strain at which particles would pass through each other, or where the bond's data end.

        -inf where they may pass: harmonic bonds, and a user's own that are given at any strain and
        of which no anharmonic term is known. Results then say that they did.
        """
        free = self.anharmonic_order is None and self.strain_min == -math.inf
        return -math.inf if free else max(-1.0, self.strain_min)

    @property
    def barrier(self) -> float:
        """U at the barrier strain; inf where there is none."""
        strain = self.barrier_strain
        return math.inf if math.isinf(strain) else float(self.energy(strain))

    @cached_property
    def compressed_root(self) -> float | None:
        """x* < 1, where U equals twice its harmonic part; None where no such length exists."""
        strain = self._find_compressed_strain()
        return None if strain is None else 1.0 + strain

    @cached_property
    def natural_speed(self) -> float | None:
        """
        v* = sqrt(2 U(x*)), the speed scale of the nonlinearity; None for harmonic.

        Rounded to 13 digits: the last ones depend on the processor, and with them would the scene
        that a speed in units of v* describes, and its key in a store of results.
        """
        strain = self._find_compressed_strain()
        if strain is None:
            return None
        return float(f"{math.sqrt(2.0 * float(self.energy(strain))):.12e}")

    def _find_compressed_strain(self) -> float | None:
        """Solve U(s)/(U'' s^2) = 1 outward from the natural length; U/s^2 starts at U''/2."""

        def excess(strain: float) -> float:
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
                return _halved(lambda strain: excess(strain) < 0.0, near, far)[1]
            near = far
        return None

    def distance_at(self, energy: float, side: float, end: float = math.inf) -> float:
        """
        Return how far from rest the bond first holds an energy, to the last bit.

        `side` is -1 for compressed bonds, 1 for stretched ones; `end` is returned where the bond
        holds less up to there.
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
        Return the compressed strain, below zero, at which the bond holds an energy.

        It stops short of -1, where particles would meet, if the bond cannot hold it.
        """
        return float(self.compressed_strains(np.array([energy]))[0])

    def compressed_strains(self, energies: Array) -> Array:
        """Return the compressed strains for many energies, of shape (energies,)."""
        floor = max(self.strain_min, -1.0)
        # Distance to the floor, found by its logarithm: log bonds get as short as exp(-energy).
        low, high = np.full(len(energies), -700.0), np.zeros(len(energies))
        with np.errstate(all="ignore"):
            if len(energies) == 1 and self.rounds_alike:
                return floor * -_expm1(np.array([self._log_distance(float(energies[0]), floor)]))
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                strains = floor * -_expm1(middle)
                held = np.broadcast_to(self.energy(strains), strains.shape)
                beyond = (held > energies) | ~np.isfinite(held)
                low, high = np.where(beyond, middle, low), np.where(beyond, high, middle)
        return floor * -_expm1(high)

    def _log_distance(self, energy: float, floor: float) -> float:
        """Return what `compressed_strains` finds for one energy, without arrays."""
        low, high = -700.0, 0.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            held = float(self.energy(floor * -math.expm1(middle)))
            if held > energy or not math.isfinite(held):
                low = middle
            else:
                high = middle
        return high

    def strain_range(self, energy: float) -> tuple[float, float]:
        """
        Return the strains between which the bond must be if it holds no more than an energy.

        They are rounded outward by less than a thousandth; inf where the energy suffices to break
        the bond.
        """
        shortest = -self._outermost(energy, -1.0, -self.strain_min)
        if energy >= self.dissociation:
            return shortest, math.inf
        return shortest, min(self._outermost(energy, 1.0, self.strain_max), self.strain_max)

    def _outermost(self, energy: float, side: float, end: float) -> float:
        """Return roughly, by a few calls, where U first exceeds an energy."""
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
        """Return whether the bond holds no more than an energy, of distances to one side."""

        def holds(distances: Array) -> NDArray[np.bool_]:
            with np.errstate(all="ignore"):
                return np.asarray(self.energy(side * distances), dtype=float) <= energy

        return holds


def stiffness_of(bond: Potential | None) -> float:
    """Return U'' at rest; 1 for an unknown bond."""
    return 1.0 if bond is None else bond.stiffness


def _halved(holds: Callable[[float], bool], inside: float, outside: float) -> tuple[float, float]:
    """Return the neighbouring numbers between which a condition ceases to hold, by halving."""
    # SciPy's root finders need fewer steps, and take longer to load than a run takes.
    while (middle := 0.5 * (inside + outside)) not in (inside, outside):
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside, outside


def _expm1(exponents: Array) -> Array:
    # NumPy's own rounds otherwise than that of the system, by which numbers have been found so far.
    return np.array([math.expm1(exponent) for exponent in exponents.tolist()])
