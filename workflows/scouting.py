"""Scouting: what a short in-house run says about a collision before LAMMPS runs it."""

from dataclasses import asdict, dataclass, replace
from typing import Any

from lammps_inputs.potentials import Harmonic
from lammps_inputs.scene import Scene
from lammps_inputs.script import ScoutedEnd
from workflows.convergence import Converged, converge, exact_modes
from workflows.engines.ending import look_interval
from workflows.engines.reference_look_ahead import bonds_in_flight
from workflows.errors import RunError
from workflows.step_guess import sharpness

# The range of bonds is settled long before eta is.
_SCOUTING_GOAL = 1e-4
# Steps that follow bonds as sharp as this take a second to cross a hundred particles; LAMMPS, with
# the far longer step that a scene asks for, says by itself what it cannot follow.
_SHARPEST = 1e4


@dataclass(frozen=True)
class Scouting:
    """
    What a short in-house run says about a collision before LAMMPS runs it.

    Attributes
    ----------
    bond_min, bond_max : float
        Shortest and longest bond.
    last_contact_time, duration : float
        Length of the collision, and of the run to the end that was argued.
    contacts : int
        Hits on the wall.
    ending : str
        ``proved``, ``argued`` or ``open``.
    fragments : int
        Connected pieces at the end.
    seconds : float
        What the scouting cost.
    """

    bond_min: float
    bond_max: float
    last_contact_time: float
    duration: float
    contacts: int
    ending: str
    fragments: int
    seconds: float

    @property
    def end(self) -> ScoutedEnd:
        """What a script must know of the end."""
        return ScoutedEnd(self.last_contact_time, self.contacts, self.ending)

    def table_range(self, scene: Scene) -> tuple[float, float]:
        """
        Return the lengths a bond table must hold.

        Parameters
        ----------
        scene : Scene
            The collision.

        Returns
        -------
        tuple of float
            Shortest and longest bond; where bonds may have broken, with room for the pieces to
            fly on until LAMMPS looks for the end.
        """
        longest = self.bond_max
        nearly_broken = scene.bond.energy(longest - 1.0) >= 0.6 * scene.bond.dissociation
        if self.fragments > 1 or nearly_broken:
            flight = 2.0 * look_interval(scene.particles, scene.bond.stiffness)
            longest = 1.0 + 1.2 * (longest - 1.0) + 2.0 * scene.impact_velocity * flight
        return self.bond_min, longest


def scouting_from(found: Converged) -> Scouting:
    """
    Take the scouting from a converged run.

    Parameters
    ----------
    found : Converged
        An in-house run.

    Returns
    -------
    Scouting
        Its bonds and its length.
    """
    outcome = found.outcome
    return Scouting(
        bond_min=outcome.bond_min,
        bond_max=outcome.bond_max,
        last_contact_time=float(outcome.contact_times[-1]),
        duration=outcome.duration,
        contacts=len(outcome.contact_times),
        ending=outcome.ending.kind,
        fragments=outcome.fragments,
        seconds=found.seconds,
    )


def scout(scene: Scene, fly_on: float = 0.0) -> Scouting | None:
    """
    Find the bond lengths of a collision that LAMMPS will run.

    Parameters
    ----------
    scene : Scene
        The collision.
    fly_on : float
        For how long after the last contact bonds are watched too.

    Returns
    -------
    Scouting or None
        None for the in-house engine, which sees its bonds, and where it cannot tell.
    """
    if scene.engine != "lammps":
        return None
    if isinstance(scene.bond, Harmonic):
        return scouting_from(exact_modes(scene))
    if sharpness(scene) > _SHARPEST:
        return None
    try:
        found = converge(scene, _SCOUTING_GOAL)
    except RunError:
        return None
    scouting = scouting_from(found)
    if fly_on > 0.0 and scene.particles > 1:
        shortest, longest = bonds_in_flight(scene, found.outcome, fly_on)
        scouting = replace(
            scouting,
            bond_min=min(scouting.bond_min, shortest),
            bond_max=max(scouting.bond_max, longest),
        )
    return scouting


def scouting_details(found: Scouting | None) -> dict[str, Any]:
    """
    Return the scouting for the record.

    Parameters
    ----------
    found : Scouting or None
        From :func:`scout`.

    Returns
    -------
    dict
        Under the key ``scouting``; empty where there was none.
    """
    return {} if found is None else {"scouting": asdict(found)}
