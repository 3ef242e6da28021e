"""A chain in motion, as the loops of the stepping engine need it."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.in_house import motion
from chaincor.workflows.engines.in_house.finish import PATIENCE, allowed_strains
from chaincor.workflows.engines.in_house.kernels import Kernels
from chaincor.workflows.engines.interrupts import steps_at_once
from chaincor.workflows.engines.schemes import StepScheme


@dataclass
class Chain:
    """
    A chain in motion, with what its loops need to work on.

    Attributes
    ----------
    ledger : numpy.record
        The scalars, see ``reference_motion.LEDGER``.
    strain, velocity : ndarray of shape (n - 1,) and (n,)
        The state, with the ledger's distance of particle 1 from the wall.
    contacts : ndarray of shape (2, capacity)
        Times and incoming speeds.
    last, kept, near, trial : pair of ndarray
        Strains and velocities after the last contact, before the step, of the particles near the
        wall while a contact is searched, and of what a step tries.
    """

    ledger: np.record
    strain: NDArray[np.float64]
    velocity: NDArray[np.float64]
    contacts: NDArray[np.float64]
    last: tuple[NDArray[np.float64], NDArray[np.float64]]
    kept: tuple[NDArray[np.float64], NDArray[np.float64]] = field(repr=False)
    near: tuple[NDArray[np.float64], NDArray[np.float64]] = field(repr=False)
    trial: tuple[NDArray[np.float64], NDArray[np.float64]] = field(repr=False)

    @classmethod
    def at_first_contact(cls, scene: Scene, scheme: StepScheme) -> "Chain":
        """
        Return the chain right after its first contact, at t = 0.

        Parameters
        ----------
        scene : Scene
            At least two particles.
        scheme : StepScheme
            Which decides how far a step reaches.

        Returns
        -------
        Chain
            Particle 1 at the wall and reflected, everything else approaching.
        """
        particles, speed = scene.particles, scene.impact_velocity
        strain = np.zeros(particles - 1)
        velocity = np.full(particles, -speed)
        velocity[0] = speed
        contacts = np.zeros((2, 2 * particles + 2 * motion.SPARE_CONTACTS))
        contacts[1, 0] = speed
        reach = min(particles - 1, scheme.reach)
        ledger = np.zeros(1, motion.LEDGER).view(np.recarray)[0]
        ledger.impact_velocity = speed
        ledger.momentum = (2 - particles) * speed
        ledger.patience = PATIENCE
        ledger.argue_after = PATIENCE * math.pi / math.sqrt(2.0 * scene.bond.stiffness)
        ledger.strain_floor, ledger.strain_ceiling = allowed_strains(scene.bond)
        ledger.contacts = 1
        ledger.step_evaluations = scheme.evaluations
        blocks = math.ceil(max(reach, motion.FRONT_MARGIN + 1) / motion.FRONT_BLOCK)
        ledger.active = min(particles - 1, blocks * motion.FRONT_BLOCK)
        return cls(
            ledger,
            strain,
            velocity,
            contacts,
            last=(strain.copy(), velocity.copy()),
            kept=(strain.copy(), velocity.copy()),
            near=(np.empty(reach), np.empty(reach + 1)),
            trial=(strain.copy(), velocity.copy()),
        )

    @classmethod
    def in_flight(
        cls,
        scene: Scene,
        scheme: StepScheme,
        displacements: NDArray[np.float64],
        velocities: NDArray[np.float64],
    ) -> "Chain":
        """
        Return a chain in any state, at t = 0.

        Parameters
        ----------
        scene : Scene
            At least two particles.
        scheme : StepScheme
            Which decides how far a step reaches.
        displacements, velocities : ndarray of shape (n,)
            The state; particle 1 is not behind the wall.

        Returns
        -------
        Chain
            Which has counted one contact before, and does not look for its end.
        """
        chain = cls.at_first_contact(scene, scheme)
        ledger = chain.ledger
        chain.strain[:] = np.diff(displacements)
        chain.velocity[:] = velocities
        ledger.wall_distance = max(float(displacements[0]), 0.0)
        ledger.momentum = float(np.sum(velocities))
        ledger.active = scene.particles - 1
        ledger.argue_after = ledger.patience = math.inf
        return chain

    def copy(self) -> "Chain":
        """
        Return a copy that can be moved without moving this one.

        Returns
        -------
        Chain
            The same state, without the contacts so far; scratch arrays are shared.
        """
        ledger = self.ledger.copy()
        ledger.contacts = 1
        return Chain(
            ledger,
            self.strain.copy(),
            self.velocity.copy(),
            np.zeros((2, 2 * motion.SPARE_CONTACTS)),
            (self.last[0].copy(), self.last[1].copy()),
            self.kept,
            self.near,
            self.trial,
        )

    def advance(self, kernels: Kernels, goal: int, step: float, scheme: StepScheme) -> int:
        """
        Take steps.

        Parameters
        ----------
        kernels : Kernels
            The loops.
        goal : int
            How many steps shall be done, from the first contact on.
        step : float
            The composed step.
        scheme : StepScheme
            What it is made of.

        Returns
        -------
        int
            Why it came back, see ``motion``.
        """
        most = steps_at_once(scheme.evaluations * len(self.strain))
        while True:
            status = kernels.advance(
                self.ledger,
                (self.strain, self.velocity),
                self.contacts,
                self.last,
                self.kept,
                self.near,
                self.trial,
                min(goal, int(self.ledger.steps) + most),
                step,
                (scheme.outer, scheme.inner),
                kernels.parameters,
            )
            if status != motion.DONE or self.ledger.steps >= goal:
                return status
