"""What two bodies in flight do next, by the in-house integrator: meet again, or never."""

import math

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.in_house.finish import unfinished_error
from chaincor.workflows.engines.in_house.follow import STEP, Flight
from chaincor.workflows.engines.in_house.lines import loop
from chaincor.workflows.engines.in_house.lines.bodies import LineInMotion
from chaincor.workflows.engines.in_house.lines.running import advance_to, watch_of
from chaincor.workflows.engines.outcome import Outcome

_MOST_HALVINGS = 8


def follow_line(
    scene: Scene,
    strains: NDArray[np.float64],
    velocities: NDArray[np.float64],
    *,
    now: float,
    last_contact: float,
    shortest: float,
) -> Flight:
    """
    Follow two bodies in flight to their next contact, or to the end of their collision.

    Parameters
    ----------
    scene : Scene
        The collision; its `line` is not None.
    strains : ndarray of shape (N - 1,)
        Of all bonds along x, with the gap.
    velocities : ndarray of shape (N,)
        Along x.
    now, last_contact : float
        The state's time, and when the last contact ended, since the first.
    shortest : float
        Shortest bond so far: with it the steps shrink.

    Returns
    -------
    Flight
        The next contact or the end.

    Raises
    ------
    RunError
        As the stepping engine.
    """
    line, bond = scene.line, scene.bond
    sharper = max(float(bond.curvature(shortest - 1.0)) / bond.stiffness, 1.0)
    step = STEP / math.sqrt(sharper * scene.fast_stiffness)
    moving = LineInMotion.of(line, bond, "order8", step, strains, velocities)
    begun = int(moving.ledger.contacts)
    watch = watch_of(scene)
    while True:
        time = now + moving.time
        if moving.ledger.contacts > begun:
            return Flight(now + float(moving.contacts[0, begun]), None)
        ending = watch.look_at(time, last_contact, moving.bodies())
        if ending is not None:
            return Flight(time, ending)
        if time > watch.followed_until(last_contact):
            raise unfinished_error(scene, time)
        later = max(watch.next_look(time, last_contact) - now, moving.time + step)
        advance_to(scene, moving, moving.steps_until(later), unresolved=f"{step:g}")


def line_bonds_in_flight(scene: Scene, outcome: Outcome, duration: float) -> tuple[float, float]:
    """
    Return how short and long bonds get in free flight after the last contact.

    Parameters
    ----------
    scene : Scene
        Its `line` is not None.
    outcome : Outcome
        Its collision, with the state right after the last contact.
    duration : float
        How long the flight is.

    Returns
    -------
    tuple of float
        Shortest and longest bond.
    """
    line = scene.line
    target = np.zeros(1), np.zeros(1)
    if line.targets:
        target = outcome.target_displacements[::-1], outcome.target_velocities[::-1]
    strains = np.diff(np.concatenate((target[0], outcome.displacements)))
    strains[line.gap] = 0.0
    velocities = np.concatenate((target[1], outcome.velocities))
    sharper = max(float(scene.bond.curvature(outcome.bond_min - 1.0)) / scene.bond.stiffness, 1.0)
    step = STEP / math.sqrt(sharper * scene.fast_stiffness)
    # Bonds may be compressed more than ever after the last contact.
    for _ in range(_MOST_HALVINGS):
        moving = LineInMotion.of(line, scene.bond, "order8", step, strains, velocities)
        if moving.advance(moving.steps_until(duration)) == loop.DONE:
            break
        step *= 0.5
    ledger = moving.ledger
    return 1.0 + float(ledger.strain_min), 1.0 + float(ledger.strain_max)
