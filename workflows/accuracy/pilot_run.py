"""PilotRun: what a short in-house run says about a collision before LAMMPS runs it."""

from dataclasses import dataclass
from typing import Any

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script_plan import ScoutedEnd
from chaincor.workflows.accuracy.by_reference import converge, exact_modes
from chaincor.workflows.accuracy.reference_runs import ConvergedRun
from chaincor.workflows.accuracy.solvers import EXACT_MODES
from chaincor.workflows.accuracy.step_guess import frequency_ratio
from chaincor.workflows.engines.end_watch import look_interval
from chaincor.workflows.engines.ending import sound_round_trip
from chaincor.workflows.engines.lammps.kept_script import scouted_end
from chaincor.workflows.engines.lammps.lammps_collision import PATIENCE
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference.coarse_run import bonds_in_flight
from chaincor.workflows.errors import RunError

# The range of bonds is settled long before eta is.
_SCOUTING_GOAL = 1e-4
# Steps that follow bonds as sharp as this take a second to cross a hundred particles; LAMMPS, with
# the far longer step that a scene asks for, says by itself what it cannot follow.
_SHARPEST = 1e4
# LAMMPS asks what comes when a contact is late, and for some steps more that may be no contact.
_ASKED_WITHIN = 1.3


@dataclass(frozen=True)
class PilotRun:
    """What an in-house run says about a collision before LAMMPS runs it."""

    reference: ConvergedRun  #: The run: its eta and error, and whether it passes kinks.
    #: Shortest and longest bond until LAMMPS stops, some time after the last contact.
    flight_min: float
    flight_max: float  #: See ``flight_min``.

    @property
    def outcome(self) -> Outcome:
        """The run that gives the number."""
        return self.reference.outcome

    @property
    def end(self) -> ScoutedEnd:
        """What a script must know of the end."""
        return scouted_end(self.outcome)

    def to_dict(self) -> dict[str, Any]:
        """Return what is known, for the record."""
        run, end = self.outcome, self.end
        return {
            "bond_min": run.bond_min,
            "bond_max": run.bond_max,
            "flight_min": self.flight_min,
            "flight_max": self.flight_max,
            "last_contact_time": end.last_contact_time,
            "duration": run.duration,
            "contacts": end.contacts,
            "ending": end.ending,
            "fragments": run.fragments,
            "seconds": self.reference.seconds,
            "timestep": run.timestep,
        }

    def table_range(self, scene: Scene) -> tuple[float, float]:
        """
        Return the shortest and longest bond that a bond table must hold.

        Where bonds may have broken, with room for the pieces to fly on until LAMMPS looks for the
        end.
        """
        longest = self.flight_max
        nearly_broken = scene.bond.energy(longest - 1.0) >= 0.6 * scene.bond.dissociation
        if self.outcome.fragments > 1 or nearly_broken:
            flight = 2.0 * look_interval(scene.longest_body, scene.slow_stiffness)
            longest = 1.0 + 1.2 * (longest - 1.0) + 2.0 * scene.impact_velocity * flight
        return self.flight_min, longest


def pilot_run(scene: Scene, target_error: float, fly_on: float | None = None) -> PilotRun:
    """
    Run a scene in-house to a target error of eta.

    `fly_on` is for how long after the last contact bonds are watched too; by default until LAMMPS
    has asked what comes, and for frames as long as they are taken. Raises RunError, as
    :func:`converge`.
    """
    return watched_on(converge(scene, target_error), scene, fly_on)


def watched_on(found: ConvergedRun, scene: Scene, fly_on: float | None = None) -> PilotRun:
    """Return the pilot run of a converged run; for `fly_on` see :func:`pilot_run`."""
    outcome = found.outcome
    shortest, longest = outcome.bond_min, outcome.bond_max
    if scene.longest_body > 1 and not scene.bond.is_harmonic:
        if fly_on is None:
            fly_on = _ASKED_WITHIN * PATIENCE / scene.slow_stiffness**0.5
            if scene.dump is not None and scene.dump_frames != "contacts":
                fly_on = max(fly_on, sound_round_trip(scene.longest_body, scene.slow_stiffness))
        low, high = bonds_in_flight(scene, outcome, fly_on)
        shortest, longest = min(shortest, low), max(longest, high)
    return PilotRun(found, shortest, longest)


def usual_pilot_run(scene: Scene, fly_on: float | None = None) -> PilotRun | None:
    """Run a scene in-house, well enough for the range of its bonds; None where that cannot be."""
    if EXACT_MODES.supports(scene):
        return watched_on(exact_modes(scene), scene, fly_on)
    if frequency_ratio(scene) > _SHARPEST:
        return None
    try:
        found = converge(scene, _SCOUTING_GOAL)
    except RunError:
        return None
    return watched_on(found, scene, fly_on)
