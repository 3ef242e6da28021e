"""
Define bonds of users, given by Python functions of the strain.

The class is also the base of bonds by formula and by table.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.check import find_kinks, refuse_mismatch, scan_strains
from chaincor.lammps_inputs.bonds.potential import Potential, halve_interval
from chaincor.lammps_inputs.errors import PotentialError, one_line
from chaincor.lammps_inputs.given_numbers import numbers_given
from chaincor.lammps_inputs.given_texts import text_given

# Bond energy of sound in a chain long after the impact, in units of the energy of two colliding
# particles. A force counts as not linear near s = 0 if its secant at this energy differs from U''
# by more than the factor `_FAR`.
_SOUND_SHARE, _FAR = 1e-4, 10.0
# A bond has a barrier if U at the strain _FAR_OUT is lower than the maximum of U. The difference
# must exceed _LOWER times the maximum, and _LOWEST times the stiffness. _BARRIERS are the smallest
# strain, the largest strain and the number of strains of the search.
_FAR_OUT, _LOWER, _LOWEST = 1e6, 1e-5, 1e-12
_BARRIERS = (1e-4, 1e3, 4000)


class UserBond(Potential):
    r"""
    Bond given by a user's functions of the strain.

    The force must be continuous and vanish at the natural length. It is checked that :math:`F =
    -dU/ds`. The force may have kinks, which are strains at which the stiffness jumps. It may vanish
    in tension.

    Parameters
    ----------
    energy, force : callable
        U(s) and -dU/dr(s) for arrays of strains; a function of one number is called for each
        strain.
    name : str
        Name in results.
    strain_min, strain_max : float
        Smallest and largest strain at which the functions may be called.
    kinks : sequence of float
        Strains at which the stiffness jumps. The attribute `kinks` also has further kinks found by
        search.

    Raises
    ------
    PotentialError
        If the force jumps, does not vanish at natural length or is not -dU/ds, if the bond is not
        stable, or if the functions do not return numbers.

    Examples
    --------
    >>> from chaincor import UserBond
    >>> quartic = UserBond(lambda s: s**2 / 2 + s**4, lambda s: -s - 4 * s**3, name="quartic")
    >>> quartic.kinks
    ()
    """

    anharmonic_order: int | None = None
    _both_given: ClassVar[bool] = True  # whether to check that energy and force agree
    _STEP = 1e-5  # step of central differences of the force, whose error is of order step^2 = 1e-10

    def __init__(
        self,
        energy: Callable,
        force: Callable,
        name: str = "user",
        strain_min: float = -1.0,
        strain_max: float = math.inf,
        kinks: Sequence[float] = (),
    ) -> None:
        self.name = text_given("name", name)
        strain_min, strain_max = numbers_given("range of strains", (strain_min, strain_max))
        kinks = numbers_given("kinks", kinks)
        if not strain_min < 0.0 < strain_max:
            raise PotentialError(
                f"bond '{name}' is given for strains {strain_min:g} to {strain_max:g}. Give a "
                "range that contains 0, the natural length"
            )
        self.strain_min, self.strain_max = strain_min, strain_max
        if not all(strain_min < kink < strain_max for kink in kinks):
            raise PotentialError(
                f"bond '{name}' has kinks {kinks}. Give kinks between {strain_min:g} and "
                f"{strain_max:g}"
            )
        self._declared = tuple(sorted(set(kinks)))
        self._energy = _of_arrays(energy, f"energy of bond '{name}'")
        self._force = _of_arrays(force, f"force of bond '{name}'")
        self.users_force = force
        self.energy_offset = float(self._energy(np.zeros(1))[0])
        at_rest = float(self.force(0.0))
        # At a kink, the stiffness on the compressed side is used.
        self.stiffness = float(self.curvature(0.0))
        if not abs(at_rest) <= 1e-9 * abs(self.stiffness):
            raise PotentialError(
                f"bond '{name}' has the force {at_rest:g} at length 1. Scale lengths so that "
                "the force vanishes at length 1"
            )
        if self._both_given and self.stiffness < 0.0 < float(self._slope_change()):
            raise PotentialError(
                f"the force of bond '{name}' has the wrong sign: it pulls where the energy falls. "
                "Return -dU/dr, the negative slope of the energy"
            )
        if not self.stiffness > 0:
            raise PotentialError(
                f"bond '{name}' has curvature {self.stiffness:g} at length 1. Give a stable "
                "bond, with positive curvature at length 1"
            )
        self.dissociation = self._end_of_energy()
        if math.isinf(self.barrier_strain):
            self.barrier_strain = self._barrier_before_end()
        if math.isfinite(self.barrier_strain):
            self.dissociation = math.inf  # broken bonds release energy
        if self._both_given:
            refuse_mismatch(self, self.kinks)

    def _slope_change(self) -> float:
        """Return the change of the energy's slope across the natural length, times a step."""
        step = min(1e-3, 0.5 * self.strain_max, -0.5 * self.strain_min)
        below, above = self.energy(np.array([-step, step]))
        return float(below + above)

    @cached_property
    def kinks(self) -> tuple[float, ...]:
        """Strains at which the stiffness jumps: declared kinks and kinks found by search."""
        found = find_kinks(self)
        apart = [s for s in found if all(abs(s - k) > 1e-7 for k in self._declared)]
        return tuple(sorted((*self._declared, *apart)))

    def energy(self, strain: ArrayLike) -> Array:
        """Return the user's energy, shifted to zero at s = 0."""
        return self._energy(np.asarray(strain, dtype=float)) - self.energy_offset

    def force(self, strain: ArrayLike) -> Array:
        """Return the user's force."""
        return self._force(np.asarray(strain, dtype=float))

    def curvature(self, strain: ArrayLike) -> Array:
        """Return -dF/ds from differences across no kink; at a kink, from the compressed side."""
        s = np.asarray(strain, dtype=float)
        below = np.maximum(s - self._STEP, self.strain_min)
        above = np.minimum(s + self._STEP, self.strain_max)
        for kink in self.kinks:
            above = np.where((s <= kink) & (kink < above), kink, above)
            below = np.where((below < kink) & (kink < s), kink, below)
        return -(self.force(above) - self.force(below)) / (above - below)

    def sound_stiffness(self, energy: float) -> float:
        """
        Return the stiffness of a slightly compressed bond, which determines the speed of sound.

        The bond stores a small fraction of `energy`. The result is U'' at s = 0, or the secant of
        the force if these two differ much. U'' is computed as a difference. If the force is not
        linear within this difference, for example for U ~ s^4 or s^1.5, the secant is right.
        """
        if self.smooth:
            return self.stiffness
        held = _SOUND_SHARE * energy
        strain = self.distance_at(held, -1.0, -self.strain_min)
        secant = 2.0 * held / strain**2 if 0.0 < strain < math.inf else self.stiffness
        far = not 1.0 / _FAR <= secant / self.stiffness <= _FAR
        return secant if far else self.stiffness

    def _end_of_energy(self) -> float:
        """Return the limit of U at infinite length: 0 without tension, inf without a limit."""
        if math.isfinite(self.strain_max):
            return math.inf
        with np.errstate(all="ignore"):
            near, far, further = self.energy(np.array([1e6, 1e9, 1e12]))
            # U of a bond that decays as r^-1 or faster is within 1e-6 of its limit at r = 1e6.
            settled = abs(far - near) <= 1e-5 * abs(far)
            settled &= abs(further - far) <= 1e-8 * abs(further)
        return float(further) if settled and further >= 0.0 else math.inf

    def _barrier_before_end(self) -> float:
        """Return the strain at the maximum of U if U is lower at large strains, otherwise inf."""
        if math.isfinite(self.strain_max):
            return math.inf
        strains = np.geomspace(*_BARRIERS)
        with np.errstate(all="ignore"):
            energies, end = self.energy(strains), float(self.energy(_FAR_OUT))
        highest = float(np.max(energies, where=np.isfinite(energies), initial=0.0))
        # The inequality is false if the end is not a number.
        if not end < (1.0 - _LOWER) * highest - _LOWEST * self.stiffness:
            return math.inf
        place = max(int(np.argmax(energies == highest)), 1)
        below, above = (float(strains[k]) for k in (place - 1, min(place + 1, len(strains) - 1)))
        return halve_interval(lambda strain: not float(self.force(strain)) > 0.0, below, above)[0]

    @cached_property
    def convex_strain(self) -> float:  # type: ignore[override]
        """Largest strain up to which the stiffness is positive at all scanned strains."""
        if self.dissociation == 0.0:
            return 0.0
        edges = scan_strains(self)
        with np.errstate(all="ignore"):
            forces = self.force(edges)
            noise = 1e-12 * (np.abs(forces[1:]) + self.stiffness * np.abs(edges[1:]))
            softer = np.diff(forces) > noise
        if np.any(softer & (edges[1:] < 0.0)):
            return 0.0
        first = np.flatnonzero(softer)
        # The inflection may be in the interval before the first interval with negative stiffness.
        return float(edges[first[0] - 1]) if len(first) else self.strain_max


def _of_arrays(function: Callable, what: str) -> Callable[..., Array]:
    """Return a function of arrays, even if the user's function takes one number at a time."""
    three = np.array([-1e-3, 0.0, 1e-3])
    try:
        # Arrays of two lengths are tried, because a function that returns equally many values for
        # both is not a function of the strain.
        returned = [(part, np.asarray(function(part))) for part in (three, three[1:])]
        takes_arrays = all(
            found.shape == part.shape and np.can_cast(found.dtype, float, "same_kind")
            for part, found in returned
        )
    except Exception:  # a function of one number may raise any error for an array
        takes_arrays = False
    if not takes_arrays:
        try:
            for strain in three.tolist():
                float(function(strain))
        except Exception as error:
            said = one_line(error)[:120]
            raise PotentialError(
                f"the {what} fails at strain 1e-3 or 0 with {type(error).__name__}: {said}. "
                "Give a function of the strain r - 1 that returns a number for each strain"
            ) from None
    return _OfArrays(function, takes_arrays)


# This is a class, because a nested function cannot be sent to worker processes.
@dataclass(frozen=True)
class _OfArrays:
    """Function of arrays; the result is nan if a user's function of one number has no value."""

    function: Callable
    takes_arrays: bool  #: Whether the user's function accepts arrays.

    def __call__(self, strains: Array) -> Array:
        if self.takes_arrays:
            return np.asarray(self.function(strains), dtype=float)
        found = np.array([self._at(strain) for strain in np.ravel(strains).tolist()])
        return found.reshape(np.shape(strains))

    def _at(self, strain: float) -> float:
        try:
            return float(self.function(strain))
        except (ValueError, OverflowError, ZeroDivisionError):
            return math.nan
