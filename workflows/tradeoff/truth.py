"""The converged values that all errors are counted from, each with its own bar."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.modes import mode_energies
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.convergence import (
    MODAL_ERROR,
    SHARE_ALONE,
    Converged,
    converge,
)
from chaincor.workflows.accuracy.in_house_runs import eta_of, run_in_house
from chaincor.workflows.accuracy.scouting import Scouting, scouting_from
from chaincor.workflows.engines.compositions import COMPOSITIONS
from chaincor.workflows.engines.in_house import modal
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.errors import RunError

# Tried in turn: near-grazing contacts and sharp bonds keep some scenes from the first.
_GOALS = (1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6)


@dataclass(frozen=True)
class Truth:
    """
    Converged values of a collision.

    Attributes
    ----------
    restitution, restitution_error : float
        eta and its bar.
    last_contact_time, last_contact_time_error : float
        Time of the last contact and its bar.
    mode_energies : ndarray of shape (n,)
        E_j right after the last contact.
    mode_energies_error : float
        Largest error of any of them, in units of the energy at impact.
    contacts : int
        Hits on the wall.
    scouting : Scouting
        Bond lengths and duration.
    source : str
        What computed it.
    """

    restitution: float
    restitution_error: float
    last_contact_time: float
    last_contact_time_error: float
    mode_energies: NDArray[np.float64]
    mode_energies_error: float
    contacts: int
    scouting: Scouting
    source: str


@dataclass(frozen=True)
class Deviation:
    """
    How far a run is from the truth.

    Attributes
    ----------
    restitution : float
        Signed error of eta.
    last_contact_time : float
        Error of the time of the last contact; inf where the number of contacts differs.
    mode_energies : float
        Largest error of any E_j, in units of the energy at impact.
    """

    restitution: float
    last_contact_time: float
    mode_energies: float


def find_truth(scene: Scene) -> Truth:
    """
    Converge a collision as far as the in-house engine goes.

    For harmonic chains by the exact propagator, else from order 8 at two steps. Raises RunError if
    no step resolves the collision.
    """
    if scene.bond.is_harmonic:
        exact = modal.run(scene)
        found = Converged(exact, eta_of(scene, exact), MODAL_ERROR, exact.seconds)
        return _truth_from(scene, found, exact, "exact modes")
    found = _converge_far(scene)
    step = found.outcome.timestep
    assert step is not None
    composition = COMPOSITIONS[found.outcome.scheme]
    coarse = run_in_house(scene, composition.name, 2.0 * step)
    source = f"in-house engine, order {composition.order}, H = {step:.4g}"
    return _truth_from(scene, found, coarse, source)


def _converge_far(scene: Scene) -> Converged:
    for goal in _GOALS:
        try:
            return converge(scene, goal)
        except RunError as error:
            failure = error
    raise failure


def _truth_from(scene: Scene, found: Converged, coarse: Outcome, source: str) -> Truth:
    outcome = found.outcome
    rounding = np.finfo(float).eps * scene.particles
    bare = Truth(
        restitution=found.restitution,
        restitution_error=found.error,
        last_contact_time=float(outcome.contact_times[-1]),
        last_contact_time_error=rounding,
        mode_energies=_modes(scene, outcome),
        mode_energies_error=rounding,
        contacts=len(outcome.contact_times),
        scouting=scouting_from(found, scene),
        source=source,
    )
    spread = deviation_from(bare, scene, coarse)
    return replace(
        bare,
        last_contact_time_error=SHARE_ALONE * spread.last_contact_time + rounding,
        mode_energies_error=SHARE_ALONE * spread.mode_energies + rounding,
    )


def _modes(scene: Scene, outcome: Outcome) -> NDArray[np.float64]:
    return mode_energies(outcome.displacements, outcome.velocities, scene.bond.stiffness)


def deviation_from(truth: Truth, scene: Scene, outcome: Outcome) -> Deviation:
    """Compare a run with the truth."""
    energy = 0.5 * scene.particles * scene.impact_velocity**2
    late = abs(float(outcome.contact_times[-1]) - truth.last_contact_time)
    same = len(outcome.contact_times) == truth.contacts
    return Deviation(
        restitution=eta_of(scene, outcome) - truth.restitution,
        last_contact_time=late if same else float("inf"),
        mode_energies=float(np.max(np.abs(_modes(scene, outcome) - truth.mode_energies))) / energy,
    )
