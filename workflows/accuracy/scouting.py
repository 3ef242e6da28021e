"""Scouting: what a short in-house run says about a collision before LAMMPS runs it."""

from dataclasses import asdict, dataclass
from typing import Any

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script_plan import ScoutedEnd
from chaincor.workflows.accuracy.convergence import Converged, converge, exact_modes
from chaincor.workflows.accuracy.step_guess import sharpness
from chaincor.workflows.engines.end_watch import look_interval
from chaincor.workflows.engines.ending import quiet_time
from chaincor.workflows.engines.in_house.coarse_run import bonds_in_flight
from chaincor.workflows.engines.in_house.modal import serves
from chaincor.workflows.engines.lammps.course import PATIENCE
from chaincor.workflows.errors import RunError

# The range of bonds is settled long before eta is.
_SCOUTING_GOAL = 1e-4
# Steps that follow bonds as sharp as this take a second to cross a hundred particles; LAMMPS, with
# the far longer step that a scene asks for, says by itself what it cannot follow.
_SHARPEST = 1e4
# LAMMPS asks what comes when a contact is late, and for some steps more that may be no contact.
_ASKED_WITHIN = 1.3


@dataclass(frozen=True)
class Scouting:
    """What a short in-house run says about a collision before LAMMPS runs it."""

    #: Shortest and longest bond up to the last contact.
    bond_min: float
    bond_max: float  #: See ``bond_min``.
    #: The same until LAMMPS stops, some time after.
    flight_min: float
    flight_max: float  #: See ``flight_min``.
    #: Length of the collision, and of the run to the end that was argued.
    last_contact_time: float
    duration: float  #: See ``last_contact_time``.
    contacts: int  #: Hits on the wall.
    ending: str  #: ``proved``, ``argued`` or ``open``.
    fragments: int  #: Connected pieces at the end.
    seconds: float  #: What the scouting cost.
    timestep: float | None = None  #: Of its steps, at whose ends bonds were looked at.

    @property
    def end(self) -> ScoutedEnd:
        """What a script must know of the end."""
        return ScoutedEnd(self.last_contact_time, self.contacts, self.ending)

    def table_range(self, scene: Scene) -> tuple[float, float]:
        """
        Return the shortest and longest bond that a bond table must hold.

        Where bonds may have broken, with room for the pieces to fly on until LAMMPS looks for the
        end.
        """
        longest = self.flight_max
        nearly_broken = scene.bond.energy(longest - 1.0) >= 0.6 * scene.bond.dissociation
        if self.fragments > 1 or nearly_broken:
            flight = 2.0 * look_interval(scene.span, scene.slow_stiffness)
            longest = 1.0 + 1.2 * (longest - 1.0) + 2.0 * scene.impact_velocity * flight
        return self.flight_min, longest


def scouting_from(found: Converged, scene: Scene, fly_on: float | None = None) -> Scouting:
    """
    Take the scouting from a converged run.

    `fly_on` is for how long after the last contact bonds are watched too; by default until LAMMPS
    has asked what comes, and for frames as long as they are taken.
    """
    outcome = found.outcome
    shortest, longest = outcome.bond_min, outcome.bond_max
    if scene.span > 1 and not scene.bond.is_harmonic:
        if fly_on is None:
            fly_on = _ASKED_WITHIN * PATIENCE / scene.slow_stiffness**0.5
            if scene.dump is not None and scene.dump_frames != "contacts":
                fly_on = max(fly_on, quiet_time(scene.span, scene.slow_stiffness))
        low, high = bonds_in_flight(scene, outcome, fly_on)
        shortest, longest = min(shortest, low), max(longest, high)
    return Scouting(
        bond_min=outcome.bond_min,
        bond_max=outcome.bond_max,
        flight_min=shortest,
        flight_max=longest,
        last_contact_time=float(outcome.contact_times[-1]),
        duration=outcome.duration,
        contacts=len(outcome.contact_times),
        ending=outcome.ending.kind,
        fragments=outcome.fragments,
        seconds=found.seconds,
        timestep=outcome.timestep,
    )


def scout(scene: Scene, fly_on: float | None = None) -> Scouting | None:
    """
    Find the bond lengths of a collision that LAMMPS will run.

    None for the in-house engine, which sees its bonds, and where it cannot tell. For `fly_on` see
    :func:`scouting_from`.
    """
    if scene.engine != "lammps":
        return None
    found = scouted_run(scene)
    return None if found is None else scouting_from(found, scene, fly_on)


def scouted_run(scene: Scene) -> Converged | None:
    """Run a scene in-house, sharply enough for a scouting; None where that cannot be."""
    if serves(scene):
        return exact_modes(scene)
    if sharpness(scene) > _SHARPEST:
        return None
    try:
        return converge(scene, _SCOUTING_GOAL)
    except RunError:
        return None


def scouting_details(found: Scouting | None) -> dict[str, Any]:
    """Return the scouting for the record, under ``scouting``; nothing where there was none."""
    return {} if found is None else {"scouting": asdict(found)}
