"""What a bond potential is: energy, force and curvature as functions of the strain."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.check import find_kinks
from chaincor.lammps_inputs.bonds.energy_levels import halved


class NoParameters(NamedTuple):
    """What the kernel of a potential without parameters is told."""


@dataclass(frozen=True)
class LogLength:
    """A bond that shrinks without bound, as a function of y = ln r."""

    kernel: Callable  #: ``kernel(y, parameters)``: -dU/dr and 1/r, for compiled loops.
    energy: Callable  #: U of an array of y.


class Potential(ABC):
    """
    A bond between neighbours, whose natural length counts as 1.

    Strain is s = r - 1 (positive: stretched). Energies are zero at s = 0; forces are -dU/dr
    (positive: the bond pushes its ends apart). Units: natural bond length, particle mass and, for
    the named potentials, bond stiffness are 1.
    """

    name: str  #: The name used in scenes.
    #: Strains must stay between these: strain_min is -1 where r > 0 is needed, -inf otherwise.
    strain_min: float = -math.inf
    strain_max: float = math.inf  #: See ``strain_min``.
    dissociation: float = math.inf  #: U at infinite length; inf for a bond that cannot break.
    #: Whether the force is known to have derivatives of every order.
    smooth: ClassVar[bool] = False
    is_harmonic: ClassVar[bool] = False  #: Whether U = s^2/2, so that a chain is a sum of modes.
    #: Constant taken off the energies, whose rounding it leaves in them.
    energy_offset: float = 0.0

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

    def as_keys(self) -> dict[str, Any]:
        """Return what decides a bond that a scene names: its parameters by their keys there."""
        return {}

    def lammps_energy(self, strain: str) -> str | None:
        """Return U as LAMMPS writes it, of a variable's name; None for a bond without formula."""
        return None

    @property
    def force_kernel(self) -> Callable | None:
        """``f(strain, parameters)`` for compiled loops; None where only :meth:`force` exists."""
        return None

    @property
    def curvature_kernel(self) -> Callable | None:
        """The same of U''; None where only :meth:`curvature` exists."""
        return None

    @property
    def users_force(self) -> Callable | None:
        """A user's own ``f(strain)``, which a compiler may try where there is no kernel."""
        return None

    @property
    def log_length(self) -> LogLength | None:
        """The bond as a function of ln r, if it gets too short for strains; None for others."""
        return None

    @property
    def parameters(self) -> tuple[Any, ...]:
        """What the kernel must be told, by name: a NamedTuple."""
        return NoParameters()

    @property
    def anharmonic_order(self) -> int | None:
        """Order of the lowest anharmonic term of U at s = 0; None for harmonic or unknown."""
        return 3

    @property
    def stiffness(self) -> float:
        """U''(1): 1 for every named potential."""
        return 1.0

    @property
    def natural_length(self) -> float:
        """Length of a bond at rest in the user's own units; the engines count it as 1."""
        return 1.0

    @cached_property
    def kinks(self) -> tuple[float, ...]:
        """Strains at which the stiffness jumps, found by looking where formulas are not known."""
        return () if self.smooth else find_kinks(self)

    @property
    def convex_strain(self) -> float:
        """Largest strain up to which U is convex; inf where it always is."""
        return math.inf

    @property
    def barrier_strain(self) -> float:
        """Strain beyond which U falls without bound; inf where there is no such barrier."""
        return math.inf

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
                return halved(lambda strain: excess(strain) < 0.0, near, far)[1]
            near = far
        return None


def stiffness_of(bond: Potential | None) -> float:
    """Return U'' at rest; 1 of a bond that is not known."""
    return 1.0 if bond is None else bond.stiffness
