"""Compute a collision's converged values, with error bars, as the reference for all errors."""

from dataclasses import dataclass, replace

import numpy as np

from chaincor.analysis.modes import mode_energies
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.by_reference import MODAL_ERROR, converge
from chaincor.workflows.accuracy.pilot_run import PilotRun, pilot_from_run
from chaincor.workflows.accuracy.reference_runs import ConvergedRun
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import modal
from chaincor.workflows.engines.schemes import STEP_SCHEMES

# The reference run aims at this error. Scenes with nearly grazing contacts or sharp bonds may miss
# this error. They are then refined as long as the error decreases.
_GOAL = 1e-13


@dataclass(frozen=True)
class Deviation:
    """Deviation of a run from the converged values."""

    restitution: float  #: Signed error of eta.
    #: Error in the time of the last contact; inf if the number of contacts differs.
    last_contact_time: float
    #: Largest error of any mode energy E_j, as a fraction of the energy at impact.
    mode_energies: float


@dataclass(frozen=True)
class ReferenceSolution:
    """Converged values of a collision."""

    scene: Scene
    #: Converged value of eta.
    restitution: float
    restitution_error: float  #: Error bar of eta.
    #: Time of the last contact.
    last_contact_time: float
    last_contact_time_error: float  #: Error bar of the time of the last contact.
    mode_energies: Array  #: Mode energies E_j right after the last contact, of shape (n,).
    #: Largest error of a mode energy, as a fraction of the energy at impact.
    mode_energies_error: float
    contacts: int  #: Number of contacts with the wall.
    scouting: PilotRun  #: Bond lengths and duration that the run found.
    source: str  #: Method of the reference run.

    @property
    def bond_range(self) -> tuple[float, float]:
        """Range of bond lengths that a table for this collision must cover."""
        return self.scouting.table_range()

    def deviation(self, outcome: Outcome) -> Deviation:
        """Return the deviation of a run from the converged values."""
        energy = 0.5 * self.scene.particles * self.scene.impact_velocity**2
        late = abs(float(outcome.contact_times[-1]) - self.last_contact_time)
        same = len(outcome.contact_times) == self.contacts
        apart = _modes(self.scene, outcome) - self.mode_energies
        return Deviation(
            restitution=outcome.eta - self.restitution,
            last_contact_time=late if same else float("inf"),
            mode_energies=float(np.max(np.abs(apart))) / energy,
        )


def find_reference(scene: Scene) -> ReferenceSolution:
    """
    Compute converged values of a collision with the reference engine.

    For harmonic chains, the exact propagator is used. Other chains are computed at ever smaller
    steps until the results at two steps agree. Raise RunError if no step resolves the collision.
    """
    if scene.bond.is_harmonic:
        exact = modal.run(scene.problem)
        found = ConvergedRun(exact, [exact], exact.eta, MODAL_ERROR, exact.seconds)
        source = "exact modes"
    else:
        found = converge(scene.problem, _GOAL)
        order = STEP_SCHEMES[found.outcome.scheme].order
        source = f"reference engine, order {order}, H = {found.outcome.timestep:.4g}"
    outcome = found.outcome
    rounding = np.finfo(float).eps * scene.particles
    bare = ReferenceSolution(
        scene=scene,
        restitution=found.restitution,
        restitution_error=found.error,
        last_contact_time=float(outcome.contact_times[-1]),
        last_contact_time_error=rounding,
        mode_energies=_modes(scene, outcome),
        mode_energies_error=rounding,
        contacts=len(outcome.contact_times),
        scouting=pilot_from_run(found),
        source=source,
    )
    spread = bare.deviation(found.proofs[-1])
    return replace(
        bare,
        last_contact_time_error=spread.last_contact_time + rounding,
        mode_energies_error=spread.mode_energies + rounding,
    )


def _modes(scene: Scene, outcome: Outcome) -> Array:
    return mode_energies(outcome.displacements, outcome.velocities, scene.bond.stiffness)
