"""What a chain in flight does next, by the in-house integrator: hit the wall again, or never."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.end_watch import EndWatch
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.in_house import motion
from chaincor.workflows.engines.in_house.chain import Chain, Stepper
from chaincor.workflows.engines.in_house.chain_coast import LookAhead
from chaincor.workflows.engines.in_house.finish import strain_error, unfinished_error

# Steps of order 8 in units of the stiffest bond's 1/frequency: good to some parts in 1e7.
STEP = 0.3


@dataclass(frozen=True)
class Flight:
    """
    What comes next.

    Attributes
    ----------
    time : float
        Of the next contact, or at which the end is seen; since the first contact.
    ending : Ending or None
        None where a contact comes.
    doubt : float
        Momentum of contacts that hardly different motions have or have not.
    """

    time: float
    ending: Ending | None
    doubt: float = 0.0


def follow(
    scene: Scene,
    displacements: NDArray[np.float64],
    velocities: NDArray[np.float64],
    *,
    now: float,
    last_contact: float,
    shortest: float,
) -> Flight:
    """
    Follow a chain in flight to its next contact, or to the end of its collision.

    Parameters
    ----------
    scene : Scene
        The collision; at least two particles.
    displacements, velocities : ndarray of shape (n,)
        The state.
    now, last_contact : float
        Its time, and that of the last contact, since the first.
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
    bond = scene.bond
    stiffest = max(float(bond.curvature(shortest - 1.0)), bond.stiffness)
    step = STEP / math.sqrt(stiffest)
    stepper = Stepper.of(bond, "order8", step)
    chain = Chain.in_flight(scene, stepper.scheme, displacements, velocities)
    chain.ledger["last_contact"] = last_contact - now
    chain.ledger["strain_min"] = shortest - 1.0
    look_ahead = LookAhead(scene, chain, stepper, chain.copy().copy, start=now)
    watch = EndWatch(scene.particles, bond)
    time = now
    while True:
        ending = watch.look(
            time, last_contact, float(chain.ledger["wall_distance"]), chain.strain, chain.velocity
        )
        if ending is not None:
            return Flight(time, look_ahead.doubt_about(ending))
        settled = look_ahead.settle()
        if settled is not None:
            coast, ending = settled
            return Flight(coast.time, look_ahead.doubt_about(ending))
        if time > watch.followed_until(last_contact):
            raise unfinished_error(scene, time)
        # At least one step: right after a contact, looks would be no time apart.
        until = max(watch.next_look(time, last_contact), time + step) - now
        status = chain.advance(stepper, math.ceil(until / step))
        if chain.ledger["contacts"] > 1:
            return Flight(now + float(chain.contact_times[1]), None, look_ahead.doubt)
        if status != motion.DONE:
            low, high = float(chain.ledger["strain_min"]), float(chain.ledger["strain_max"])
            remedy = f"take a smaller timestep than {step:g}, or a lower speed"
            raise strain_error(scene, low, high, time, remedy)
        time = now + float(chain.ledger["steps"] * step)
