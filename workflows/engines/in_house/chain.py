"""A chain in motion, as the loops of the stepping engine need it."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.in_house import motion
from chaincor.workflows.engines.in_house.blocks import running
from chaincor.workflows.engines.in_house.finish import PATIENCE, allowed_strains
from chaincor.workflows.engines.in_house.kernels import Kernels, kernels_for
from chaincor.workflows.engines.in_house.loops.cores import cores
from chaincor.workflows.engines.in_house.stages import State
from chaincor.workflows.engines.interrupts import steps_at_once
from chaincor.workflows.engines.schemes import STEP_SCHEMES, StepScheme
from chaincor.workflows.engines.time_limit import check_time


@dataclass(frozen=True)
class Stepper:
    """
    Steps of one kind and size.

    Attributes
    ----------
    kernels : Kernels
        The loops of the bonds' potential.
    scheme : StepScheme
        What a step is made of.
    step : float
        The whole step H.
    """

    kernels: Kernels
    scheme: StepScheme
    step: float

    @classmethod
    def of(cls, bond: Potential, scheme: str, step: float) -> "Stepper":
        """
        Return the steps for a potential.

        Parameters
        ----------
        bond : Potential
            Its loops are compiled, or loaded, where they have not been yet.
        scheme : str
            Of ``schemes``.
        step : float
            The whole step H.

        Returns
        -------
        Stepper
            The steps.
        """
        made_of = STEP_SCHEMES[scheme]
        return cls(kernels_for(bond, made_of), made_of, step)

    def of_size(self, step: float) -> "Stepper":
        """Return steps of the same kind."""
        return replace(self, step=step)


@dataclass
class Chain:
    """
    A chain in motion, with what its loops need to work on.

    Attributes
    ----------
    ledger : numpy.record
        The scalars, see ``motion.LEDGER``.
    arrays : Arrays
        The chain now and right after its last contact, the contacts, and scratch.
    """

    ledger: np.record
    arrays: motion.Arrays

    @property
    def strain(self) -> NDArray[np.float64]:
        """Bond lengths less one, of shape (n - 1,); to be changed in place."""
        return self.arrays.now.strain

    @property
    def velocity(self) -> NDArray[np.float64]:
        """Velocities, of shape (n,); to be changed in place."""
        return self.arrays.now.velocity

    @property
    def contact_times(self) -> NDArray[np.float64]:
        """When particle 1 hit the wall."""
        return self.arrays.contacts[0, : self.ledger["contacts"]]

    @property
    def contact_speeds(self) -> NDArray[np.float64]:
        """How fast it came in."""
        return self.arrays.contacts[1, : self.ledger["contacts"]]

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
        now = State.room(particles - 1)
        now.strain[:] = 0.0
        now.velocity[:] = -speed
        now.velocity[0] = speed
        contacts = np.zeros((2, 2 * particles + 2 * motion.SPARE_CONTACTS))
        contacts[1, 0] = speed
        reach = min(particles - 1, scheme.reach)
        ledger = np.zeros(1, motion.LEDGER).view(np.recarray)[0]
        ledger["impact_velocity"] = speed
        ledger["momentum"] = (2 - particles) * speed
        ledger["patience"] = PATIENCE
        ledger["argue_after"] = PATIENCE * math.pi / math.sqrt(2.0 * scene.bond.stiffness)
        ledger["strain_floor"], ledger["strain_ceiling"] = allowed_strains(scene.bond)
        ledger["contacts"] = 1
        ledger["step_evaluations"] = scheme.evaluations
        blocks = math.ceil(max(reach, motion.FRONT_MARGIN + 1) / motion.FRONT_BLOCK)
        ledger["active"] = min(particles - 1, blocks * motion.FRONT_BLOCK)
        last, kept, trial = (now.copied() for _ in range(3))
        log = np.empty((2, 0))
        return cls(ledger, motion.Arrays(now, last, kept, State.room(reach), trial, contacts, log))

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
        ledger["wall_distance"] = max(float(displacements[0]), 0.0)
        ledger["momentum"] = float(np.sum(velocities))
        ledger["active"] = scene.particles - 1
        ledger["argue_after"] = ledger["patience"] = math.inf
        return chain

    def copy(self, room: int = 2 * motion.SPARE_CONTACTS) -> "Chain":
        """
        Return a copy that can be moved without moving this one.

        Parameters
        ----------
        room : int
            For how many contacts.

        Returns
        -------
        Chain
            The same state, without the contacts so far; scratch arrays are shared.
        """
        ledger = self.ledger.copy()
        ledger["contacts"] = 1
        own = self.arrays._replace(
            now=self.arrays.now.copied(),
            last=self.arrays.last.copied(),
            contacts=np.zeros((2, room)),
        )
        return Chain(ledger, own)

    def after_last_contact(self) -> "Chain":
        """Return a copy as it was right after its last contact, at t = 0 then."""
        chain, last = self.copy(), self.arrays.last
        chain.strain[:], chain.velocity[:] = last.strain, last.velocity
        chain.ledger["wall_distance"] = chain.ledger["last_contact"] = 0.0
        chain.ledger["steps"] = 0
        return chain

    def make_room(self) -> None:
        """Double the room for contacts."""
        contacts = self.arrays.contacts
        more = np.concatenate((contacts, np.zeros_like(contacts)), axis=1)
        self.arrays = self.arrays._replace(contacts=more)

    def advance(self, stepper: Stepper, goal: int) -> int:
        """
        Take steps.

        Parameters
        ----------
        stepper : Stepper
            Which steps.
        goal : int
            How many of them shall be done, from the first contact on.

        Returns
        -------
        int
            Why it came back, see ``motion``.
        """
        kernels, scheme, ledger = stepper.kernels, stepper.scheme, self.ledger
        count = cores() if len(self.strain) >= running.LEAST_ACTIVE else 1
        loops = _block_loops(stepper) if count > 1 else None
        most = steps_at_once(scheme.evaluations * len(self.strain))
        arrays, fractions = self.arrays.unnamed(), tuple(scheme.fractions)
        while True:
            check_time()
            steps = int(ledger["steps"])
            if loops is not None and running.pays(int(ledger["active"]), goal - steps):
                return running.advance(ledger, self.arrays, loops, goal, count)
            until = min(goal, steps + most)
            status = kernels.advance(
                ledger, arrays, until, stepper.step, fractions, kernels.parameters
            )
            if status != motion.DONE or ledger["steps"] >= goal:
                return int(status)


def _block_loops(stepper: Stepper) -> running.Loops | None:
    """Return what carries chains on several cores; None where NumPy does, on one."""
    kernels, scheme = stepper.kernels, stepper.scheme
    if kernels.load_move is None:
        return None
    move, fractions = kernels.load_move(), tuple(scheme.fractions)
    loops = running.Loops(
        kernels.advance, move, kernels.parameters, fractions, scheme.reach, stepper.step
    )
    running.load(loops)
    return loops
