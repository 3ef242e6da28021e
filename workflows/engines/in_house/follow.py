"""What bodies in flight do next, by the in-house integrator: meet again, or never."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.end_watch import EndWatch
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.in_house import bookkeeping
from chaincor.workflows.engines.in_house.finish import strain_error, unfinished_error
from chaincor.workflows.engines.in_house.look_ahead import LookAhead
from chaincor.workflows.engines.in_house.moving import Motion, Stepper

# Steps of order 8 in units of the stiffest bond's 1/frequency: good to some parts in 1e7.
STEP = 0.3


@dataclass(frozen=True)
class Flight:
    """What comes next."""

    time: float  #: Of the next contact, or at which the end is seen; since the first contact.
    ending: Ending | None  #: None where a contact comes.
    doubt: float = 0.0  #: Momentum of contacts that hardly different motions have or have not.


def follow(
    scene: Scene,
    strains: NDArray[np.float64],
    velocities: NDArray[np.float64],
    *,
    now: float,
    last_contact: float,
    shortest: float,
) -> Flight:
    """
    Follow bodies in flight to their next contact, or to the end of their collision.

    Parameters
    ----------
    scene : Scene
        With at least one bond.
    strains : ndarray of shape (N - 1,)
        Of all bonds along x, with the gap.
    velocities : ndarray of shape (N,)
        Along x.
    now, last_contact : float
        The state's time, and when the last contact ended, since the first.
    shortest : float
        Shortest bond so far: with it the steps shrink.

    Raises
    ------
    RunError
        As the stepping engine.
    """
    line, bond = scene.line, scene.bond
    stiffest = max(float(bond.curvature(shortest - 1.0)), bond.stiffness)
    step = STEP / math.sqrt(stiffest / line.lightest)
    stepper = Stepper.of(line, bond, "order8", step)
    strains = strains.copy()
    strains[line.gap] = max(float(strains[line.gap]), 0.0)
    moving = Motion.in_state(line, bond, stepper.scheme, strains, velocities, scene.impact_velocity)
    ledger = moving.ledger
    ledger["patience"] = ledger["argue_first"] = math.inf
    ledger["last_contact"] = last_contact - now
    ledger["strain_min"] = shortest - 1.0
    look_ahead = LookAhead(scene, moving, stepper, moving.copy().copy, start=now)
    watch = EndWatch(scene.span, bond, scene.slow_stiffness)
    time = now
    while True:
        ending = watch.look_at(time, last_contact, moving.bodies(bond))
        if ending is not None:
            return Flight(time, look_ahead.doubt_about(ending))
        settled = look_ahead.settle()
        if settled is not None:
            ahead, ending = settled
            return Flight(ahead.time, look_ahead.doubt_about(ending))
        if time > watch.followed_until(last_contact):
            raise unfinished_error(scene, time)
        # At least one step: right after a contact, looks would be no time apart.
        until = max(watch.next_look(time, last_contact), time + step) - now
        status = moving.advance(stepper, math.ceil(until / step))
        if ledger["contacts"] > 0:
            return Flight(now + float(moving.contact_times[0]), None, look_ahead.doubt)
        if status != bookkeeping.DONE:
            low, high = float(ledger["strain_min"]), float(ledger["strain_max"])
            remedy = f"take a smaller timestep than {step:g}, or a lower speed"
            raise strain_error(scene, low, high, time, remedy)
        time = now + float(ledger["steps"] * step)
