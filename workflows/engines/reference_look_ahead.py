"""Looking ahead with the stepping engine: a copy of the chain flies on with coarse steps."""

import math

import numpy as np
from numpy.typing import NDArray

from lammps_inputs.scene import Scene
from workflows.engines.interrupts import steps_at_once
from workflows.engines.kernels import Kernels, kernels_for
from workflows.engines.look_ahead import coarse_step, find_end, required_clearance
from workflows.engines.outcome import Outcome
from workflows.engines.reference_chain import Chain
from workflows.engines.reference_steps import STEP_SCHEMES, StepScheme


class ChainCoast:
    """
    A copy of a chain that flies ahead with coarse steps.

    Parameters
    ----------
    chain : Chain
        In flight; not changed.
    kernels : Kernels
        The loops.
    now : float
        Time since the first contact.
    step : float
        The Verlet step.
    clearance : float
        How near to the wall particle 1 may come.

    Attributes
    ----------
    chain : Chain
        The copy.
    time : float
        Time since the first contact.
    """

    def __init__(
        self, chain: Chain, kernels: Kernels, now: float, step: float, clearance: float
    ) -> None:
        self.chain, self.time = chain.copy(), now
        self._kernels, self._step, self._clearance = kernels, step, clearance

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
            False where particle 1 comes nearer to the wall than allowed, or a bond is as no bond
            may be: the chain is there then.
        """
        steps = max(1, math.ceil(duration / self._step))
        done, most = 0, steps_at_once(len(self.chain.strain))
        for begin in range(0, steps, most):
            part = min(most, steps - begin)
            taken = self._kernels.coast(
                self.chain.ledger,
                self.chain.strain,
                self.chain.velocity,
                part,
                self._step,
                self._clearance,
                begin == 0,
                begin + part == steps,
                self._kernels.parameters,
            )
            done += taken
            if taken < part:
                break
        self.time += done * self._step
        return bool(done == steps)

    def state(self) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """
        Return where the chain is.

        Returns
        -------
        tuple
            Distance of particle 1 from the wall, strains and velocities.
        """
        return float(self.chain.ledger.wall_distance), self.chain.strain, self.chain.velocity


class LookAhead:
    """
    Finds out, ahead of an exact run, that no further contact comes.

    Parameters
    ----------
    scene : Scene
        The collision.
    chain : Chain
        The chain, which is not changed but for its count of force evaluations.
    kernels : Kernels
        Its loops.
    scheme : StepScheme
        Its steps: where coarse ones are no cheaper, they are not taken.
    step : float
        Their size.
    """

    def __init__(
        self, scene: Scene, chain: Chain, kernels: Kernels, scheme: StepScheme, step: float
    ) -> None:
        self._scene, self._chain, self._kernels = scene, chain, kernels
        self._scheme, self._step = scheme, step
        self.not_before = 0.0

    def warm_up(self) -> None:
        """Load or compile the loop, which is not integration."""
        ChainCoast(self._chain, self._kernels, 0.0, 1.0, -math.inf).fly(0.0)

    def settle(self) -> tuple[ChainCoast, str] | None:
        """
        Look ahead from where the chain is.

        Returns
        -------
        tuple of ChainCoast and str, or None
            The coarse motion at the end of the collision, and the argument; None where another
            contact may come.
        """
        ledger, scene = self._chain.ledger, self._scene
        now = float(ledger.steps * self._step)
        clearance = required_clearance(scene, float(ledger.wall_distance))
        coarse = coarse_step(scene.bond, float(ledger.strain_min))
        if now < self.not_before or clearance is None:
            return None
        if 1.0 / coarse >= self._scheme.evaluations / self._step:
            return None
        coast = ChainCoast(self._chain, self._kernels, now, coarse, clearance)
        argument = find_end(scene, coast, float(ledger.last_contact))
        if argument is not None:
            return coast, argument
        ledger.evaluations = coast.chain.ledger.evaluations
        self.not_before = coast.time
        return None


def bonds_in_flight(scene: Scene, outcome: Outcome, duration: float) -> tuple[float, float]:
    """
    Return how short and long bonds get in free flight after the last contact.

    Parameters
    ----------
    scene : Scene
        At least two particles.
    outcome : Outcome
        Its collision, with the state right after the last contact.
    duration : float
        How long the flight is.

    Returns
    -------
    tuple of float
        Shortest and longest bond, good to some parts in 1e3 of their strains; flight ends early
        where a bond is as no bond may be.
    """
    scheme = STEP_SCHEMES["verlet"]
    chain = Chain.at_first_contact(scene, scheme)
    chain.strain[:] = np.diff(outcome.displacements)
    chain.velocity[:] = outcome.velocities
    step = coarse_step(scene.bond, outcome.bond_min - 1.0)
    coast = ChainCoast(chain, kernels_for(scene.bond, scheme), 0.0, step, -math.inf)
    coast.fly(duration)
    ledger = coast.chain.ledger
    return 1.0 + float(ledger.strain_min), 1.0 + float(ledger.strain_max)
