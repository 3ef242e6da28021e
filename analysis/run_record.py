"""Record of one finished collision, from which observables are computed."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from chaincor.analysis.error_bar import ErrorBar
from chaincor.analysis.modes import mode_energies
from chaincor.analysis.restitution import EnergySplit, centre_of_mass_velocity, energy_split
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line

if TYPE_CHECKING:
    from chaincor.lammps_inputs.bonds.formula import Formula
    from chaincor.lammps_inputs.scene import Scene

# The stiffness or length of a bond is shown if it differs from 1 by more than the error of
# numerical differentiation.
_ROUNDED = 1e-9


@dataclass(frozen=True)
class RunRecord:
    """Record of a finished collision: the scene, the raw outcome and its error bar."""

    scene: "Scene"
    #: Raw outcome of the engine.
    outcome: Any
    bar: ErrorBar  #: Error bar of eta.
    restitution: float  #: Restitution eta.
    #: Why a tolerance is not met; None if it is met or there is no tolerance.
    reason: str | None
    details: dict[str, Any]  #: Results of the search for scheme and time step.
    seconds_total: float  #: Wall-clock time of the whole request.
    versions: dict[str, str]
    #: Interval between two checks of bond lengths, if the outcome has no time step; None if the
    #: interval varies.
    looks: float | None = None
    #: Other raw outcomes of this collision, from which the error bar was estimated.
    others: tuple[Any, ...] = field(default=(), repr=False)

    @property
    def line(self) -> Line:
        """Both bodies along x."""
        return self.scene.line

    @property
    def table(self) -> dict[str, Any]:
        """Certificate of the bond table; empty without a bond table."""
        return self.outcome.details.get("table") or {}

    @property
    def asked(self) -> float | None:
        """Required error of eta; None if the time step was given instead."""
        return self.scene.asked_tolerance

    @property
    def tolerance_met(self) -> bool | None:
        """Whether the error bar is within the tolerance; None if either of the two is unknown."""
        unknown = self.asked is None or self.bar.total is None
        return None if unknown else self.bar.total <= self.asked  # type: ignore[operator]

    @property
    def energy_drift(self) -> float:
        """Relative change of the total energy, not counting energy removed by damping."""
        run = self.outcome
        change = run.energy_end - run.energy_start + (run.dissipated or 0.0)
        return float(change / run.energy_start)

    # ---- contacts -------------------------------------------------------------------------------

    @property
    def contacts_range(self) -> tuple[int, int] | None:
        """Smallest and largest number of contacts in the compared runs; None if all agree."""
        counts = [len(each.contact_times) for each in (self.outcome, *self.others)]
        return None if min(counts) == max(counts) else (min(counts), max(counts))

    @property
    def last_contact_error(self) -> float | None:
        """
        Return the error bar of the last contact's time.

        The error bar is the largest difference between runs in the time of a contact, plus the
        errors that all runs share. The result is None if no other run was compared, or if the
        numbers of contacts differ.
        """
        error = self.details.get("spread", {}).get("contact_times")
        return error if error is not None and math.isfinite(error) else None

    # ---- bonds ----------------------------------------------------------------------------------

    @property
    def pilot(self) -> dict[str, Any] | None:
        """Pilot run by the reference engine before a LAMMPS run; None without a pilot run."""
        return self.details.get("scouting")

    @property
    def _pilot_has_bonds(self) -> bool:
        """Whether the bond lengths of the pilot run also apply to this LAMMPS run."""
        return self.pilot is not None and self.pilot["bond_min"] is not None

    @property
    def bond_range_source(self) -> str:
        """Runs from which the shortest and longest bond come, and when these runs checked bonds."""
        if self.outcome.engine != "lammps":
            return "every step"
        if not self._pilot_has_bonds:
            return "LAMMPS, at contacts and at looks between them"
        return "pilot run, every step, and LAMMPS at contacts"

    @cached_property
    def bond_range(self) -> tuple[float, float]:
        """Lengths of the shortest and the longest bond."""
        low, high = self.outcome.bond_min, self.outcome.bond_max
        if self._pilot_has_bonds:
            assert self.pilot is not None
            low, high = min(low, self.pilot["bond_min"]), max(high, self.pilot["bond_max"])
        return low, high

    def bond_length(self, end: int) -> float:
        """Return the shortest (0) or longest (1) bond, in the scene's units of length."""
        return self.bond_range[end] + (self.scene.bond.natural_length - 1.0)

    def bond_error(self) -> float | None:
        """
        Return the bound of :func:`missed_strain`.

        The bound is None if steps have no fixed length, or if only LAMMPS evaluated the bonds.
        """
        if self.scene.problem.longest_body < 2:
            return 0.0
        if self.outcome.engine == "lammps" and not self._pilot_has_bonds:
            return None
        step = self.outcome.timestep if self.pilot is None else self.pilot["timestep"]
        step = self.looks if step is None else step
        if step is None:
            return None
        return float(missed_strain(self.scene.bond, self.line.lightest, step, *self.bond_range))

    def formula(self) -> "Formula | None":
        """Return the bond if a formula defines it, else None."""
        from chaincor.lammps_inputs.bonds.formula import Formula

        return self.scene.bond if isinstance(self.scene.bond, Formula) else None

    def unless_one(self, name: str) -> float | None:
        """Return a property of the bond; None if it is 1."""
        value = float(getattr(self.scene.bond, name))
        return value if abs(value - 1.0) > _ROUNDED else None

    # ---- bodies ---------------------------------------------------------------------------------

    @cached_property
    def bodies_given(self) -> dict[str, Any]:
        """Scene keys that describe the bodies; empty for a cold chain of unit masses and a wall."""
        from chaincor.lammps_inputs.scene_parts.given_bodies import given_bodies, seed_of

        if self.line.is_standard:
            return {}
        given, state = given_bodies(self.scene), self.scene.initial_state
        if state is not None and state.masses is not None:
            given["masses"] = tuple(state.masses.tolist())
        if self.scene.temperature is not None:
            given["seed"] = seed_of(self.scene)
        if self.line.soft:
            given |= self.line.contact.as_keys()
        else:
            given.pop("contact", None)
        return given

    @cached_property
    def chain(self) -> EnergySplit | None:
        """Energies of the chain; None for a standard scene, in which eta determines them."""
        if self.line.is_standard:
            return None
        state = self.outcome.displacements, self.outcome.velocities
        return energy_split(*state, self.scene.bond, masses=self.line.chain_masses)

    @cached_property
    def target(self) -> EnergySplit | None:
        """Energies of a free target; None for a wall."""
        if self.line.is_standard or self.line.rigid:
            return None
        # From the contact outward, a target extends towards -x. Its mirror image is a chain.
        state = -self.outcome.target_displacements, -self.outcome.target_velocities
        return energy_split(*state, self.scene.bond, masses=self.line.target_masses)

    def velocity_after(self, owner: str) -> float | None:
        """Return the velocity of the ``chain`` or ``target``; None if its energies are None."""
        if getattr(self, owner) is None:
            return None
        outcome = self.outcome
        moving = outcome.velocities if owner == "chain" else outcome.target_velocities
        masses = self.line.chain_masses if owner == "chain" else self.line.target_masses
        return float(centre_of_mass_velocity(moving, masses))

    def energy(self, owner: str, part: str) -> float | None:
        """Return a part of the energy of the ``chain`` or the ``target``."""
        split = getattr(self, owner)
        return None if split is None else float(getattr(split, part))

    def of_target(self, name: str) -> Array | None:
        """Return an array of a free target from the outcome; None for a wall."""
        return None if self.target is None else getattr(self.outcome, f"target_{name}")

    def target_mode_energies(self) -> Array | None:
        """Return the mode energies of a free target, of shape (M,); None for a wall."""
        if self.target is None or self.scene.bond.only_pushes:
            return None
        state = self.outcome.target_displacements, self.outcome.target_velocities
        return mode_energies(*state, self.scene.bond.stiffness, self.line.target_masses)


def missed_strain(bond: Potential, lightest: float, step: Any, low: Any, high: Any) -> Any:
    r"""
    Return a bound on the strain that may have been missed between the ends of steps.

    An extreme strain is at most half a step h away from the end of a step. The strain s has
    :math:`|\ddot s| \le 4 F/m` with the largest force F and the smallest mass m = `lightest`. The
    missed strain is therefore at most :math:`h^2 F/2m`. `low` and `high` are the lengths of the
    shortest and longest bond; they and `step` may be arrays with one item for each run.
    """
    with np.errstate(all="ignore"):
        forces = np.abs(bond.force(np.linspace(low - 1.0, high - 1.0, 65)))
    return 0.5 * (step * step) * np.nanmax(forces, axis=0) / lightest


def impulse_residual(line: Line, outcome: Any, impact_velocity: float) -> float:
    """
    Return the momentum that the impulses of the contacts do not explain, in units of M v0.

        Each contact gives the chain its impulse and the target the opposite impulse. The result is
        the larger residual of the two bodies. With a wall, only the chain has a residual.
    """
    given = float(np.sum(outcome.impulses))
    mass = line.chain_mass
    change = float(line.chain_masses @ outcome.velocities) + mass * impact_velocity
    residuals = [abs(change - given)]
    if not line.rigid:
        residuals.append(abs(float(line.target_masses @ outcome.target_velocities) + given))
    return max(residuals) / (mass * impact_velocity)
