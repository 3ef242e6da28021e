"""After the last contact: carrying the chain to the end of its quiet time with cheap steps."""

import math

import numpy as np

from lammps_inputs.scene import Scene
from workflows.engines.ending import argue_end, longest_collision, look_interval
from workflows.engines.lammps_chain import LammpsChain
from workflows.engines.lammps_flight import BlindBound, VerletFlight

# Verlet steps in units of the fastest bond's 1/frequency. Long waves, which move particle 1 as a
# whole, come out to 1e-3; the shortest lose their phase, but cannot carry it half-way to the wall.
QUIET_STEP = 0.1
# Contacts are 1.4 to 2.3 apart, in units of 1/sqrt(U''), and seldom more than this: a look ahead
# that meets one is cheap, but for nothing.
PATIENCE = 3.5
# Particle 1 must stay off even a wall that has come half its distance nearer.
_CLEARANCE = 0.5


class LookAhead:
    """
    Finds out, ahead of an exact run, that no further contact comes.

    The result of a collision is the state right after its last contact. What follows only has to
    show that it was the last, and particle 1 keeps so clear of the wall then that coarse Verlet
    steps show it as well as exact ones. Where the coarse motion does come near the wall, the
    chain is put back and nothing has been said.

    Parameters
    ----------
    scene : Scene
        The collision.
    chain : LammpsChain
        The chain.
    bond_range : tuple of float
        Lengths between which bonds are known, see :class:`BlindBound`.
    reflect : bool
        Whether LAMMPS's own fix mirrors particle 1 at the wall: then a coarse step that ends
        there must be taken for a contact before the fix hides it.
    """

    def __init__(
        self, scene: Scene, chain: LammpsChain, bond_range: tuple[float, float], reflect: bool
    ) -> None:
        self._chain, self._bond, self._range = chain, scene.bond, bond_range
        self._reflect = reflect
        self._rest = np.arange(scene.particles, dtype=float)
        self._interval = look_interval(scene.particles, self._bond.stiffness)
        self._cap = longest_collision(scene.particles, self._bond.stiffness)
        self._not_before = -math.inf

    def settle(self, now: float, last_contact: float, shortest: float) -> tuple[float, str] | None:
        """
        Go on to the end of the collision, if no contact comes before it.

        Parameters
        ----------
        now : float
            Time since the first contact; the chain is in flight.
        last_contact : float
            Time of the last contact so far.
        shortest : float
            Shortest bond so far: with it the steps shrink.

        Returns
        -------
        tuple of float and str, or None
            Time of the end and its argument, the chain being there; or None, the chain being
            where it was.
        """
        chain = self._chain
        clear = float(chain.x[0])
        if now < self._not_before or clear <= 0.0 or float(np.sum(chain.v)) <= 0.0:
            return None
        if now - last_contact < PATIENCE / math.sqrt(self._bond.stiffness):
            return None
        coarse = self._timestep(shortest)
        if len(chain.weights) == 1 and chain.timestep >= coarse:
            return None
        state, timestep = chain.snapshot(), chain.timestep
        shift = _CLEARANCE * clear
        chain.timestep = coarse
        chain.x[:] -= shift
        ending = None
        try:
            bound = BlindBound(self._bond, self._range, chain.timestep)
            flight = VerletFlight(chain, self._reflect, bound)
            while ending is None:
                if flight.advance(flight.time + self._interval) is not None:
                    break
                time = now + flight.time
                ending = argue_end(
                    float(chain.x[0]) + shift,
                    np.diff(chain.x - self._rest),
                    chain.v.copy(),
                    time - last_contact,
                    self._bond,
                )
                if time > self._cap:
                    break
        finally:
            chain.timestep = timestep
        if ending is None:
            self._not_before = now + flight.time
            chain.restore(state)
            return None
        chain.x[:] += shift
        return now + flight.time, ending

    def _timestep(self, shortest: float) -> float:
        stiffest = max(float(self._bond.curvature(shortest - 1.0)), self._bond.stiffness)
        return QUIET_STEP / math.sqrt(stiffest)
