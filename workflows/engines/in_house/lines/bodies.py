"""Two bodies in motion, as the loop of ``lines.loop`` needs them."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.end_watch import Body
from chaincor.workflows.engines.in_house.finish import allowed_strains
from chaincor.workflows.engines.in_house.lines import loop
from chaincor.workflows.engines.in_house.lines.compiled import LineKernels, line_kernels_for
from chaincor.workflows.engines.in_house.lines.verlet import LineParameters
from chaincor.workflows.engines.in_house.stages import State
from chaincor.workflows.engines.interrupts import steps_at_once
from chaincor.workflows.engines.parting import bodies_of
from chaincor.workflows.engines.schemes import STEP_SCHEMES, StepScheme
from chaincor.workflows.engines.time_limit import check_time

Array = NDArray[np.float64]


@dataclass
class LineInMotion:
    """
    Two bodies in motion.

    Attributes
    ----------
    line : Line
        What they are.
    bond : Potential
        Their bonds.
    scheme : StepScheme
        What a step is made of.
    kernels : LineKernels
        The loop.
    step : float
        H.
    ledger : numpy.record
        The scalars, see ``loop.LINE_LEDGER``.
    arrays : LineArrays
        The bodies now and after their last contact, the contacts, and scratch.
    """

    line: Line
    bond: Potential
    scheme: StepScheme
    kernels: LineKernels
    step: float
    ledger: np.record
    arrays: loop.LineArrays

    @classmethod
    def of(
        cls,
        line: Line,
        bond: Potential,
        scheme: str,
        step: float,
        strains: Array,
        velocities: Array,
    ) -> "LineInMotion":
        """
        Return the bodies in a state, at t = 0; if they touch and approach, they have met.

        Parameters
        ----------
        line : Line
            What they are.
        bond : Potential
            Their bonds; the loop is compiled, or loaded, where that has not been done yet.
        scheme : str
            Of ``schemes``.
        step : float
            H.
        strains : ndarray of shape (N - 1,)
            Of all bonds along x, with the gap, which is not negative.
        velocities : ndarray of shape (N,)
            Along x.
        """
        made_of = STEP_SCHEMES[scheme]
        now = State(strains.astype(float), velocities.astype(float))
        begin = max(0, line.gap - made_of.reach)
        end = min(len(velocities), line.first + made_of.reach + 1)
        near = State(np.empty(end - begin - 1), np.empty(end - begin))
        masses = line.masses.copy()
        masses[: line.first] = 0.0
        ledger = np.zeros(1, loop.LINE_LEDGER).view(np.recarray)[0]
        ledger.soft = line.soft
        ledger.shortest_share = 1.0 if line.smooth else loop.SHORTEST_SHARE
        ledger.contact_mass = line.contact_mass
        # The target's first particle is at its place.
        ledger.position = -float(np.sum(strains[: line.gap]))
        ledger.strain_floor, ledger.strain_ceiling = allowed_strains(bond)
        bonds = np.delete(strains, line.gap)
        ledger.strain_min = min(float(np.min(bonds, initial=0.0)), 0.0)
        ledger.strain_max = max(float(np.max(bonds, initial=0.0)), 0.0)
        ledger.contact_min, ledger.contact_max = ledger.strain_min, ledger.strain_max
        ledger.step_evaluations = made_of.evaluations
        arrays = loop.LineArrays(
            now=now,
            last=_copied(now),
            kept=_copied(now),
            trial=_copied(now),
            near=near,
            near_trial=_copied(near),
            contacts=np.zeros((3, 2 * len(velocities) + 2 * loop.SPARE_CONTACTS)),
            masses=masses,
            window=np.array([begin, end]),
        )
        moving = cls(line, bond, made_of, line_kernels_for(bond, made_of), step, ledger, arrays)
        moving.meet()
        return moving

    def meet(self) -> None:
        """Let bodies that touch and approach have their contact."""
        gap, first = self.line.gap, self.line.first
        strain, velocity = self.arrays.now
        closing = float(velocity[gap] - velocity[first])
        if strain[gap] != 0.0 or closing <= 0.0:
            return
        ledger, given = self.ledger, 2.0 * self.line.contact_mass * closing
        if self.line.soft:
            ledger.touching = 1
            ledger.chain_momentum = float(self.line.chain_masses @ velocity[first:])
        else:
            velocity[gap] -= given * self.line.inverse_masses[gap]
            velocity[first] += given * self.line.inverse_masses[first]
        self.arrays.contacts[:, 0] = 0.0, closing, given
        ledger.contacts = 1
        ledger.last_position = ledger.position
        for new, old in zip(self.arrays.last, self.arrays.now, strict=True):
            new[:] = old

    @property
    def time(self) -> float:
        """Since the start."""
        return float(self.ledger.steps * self.step)

    @property
    def contacts(self) -> Array:
        """Times and closing speeds, and the momentum given to the chain: shape (3, contacts)."""
        return self.arrays.contacts[:, : self.ledger.contacts]

    @property
    def strains(self) -> Array:
        """Of all bonds along x, with the gap."""
        return self.arrays.now.strain

    @property
    def velocities(self) -> Array:
        """Along x."""
        return self.arrays.now.velocity

    def bodies(self) -> list[Body]:
        """Return the bodies as the end of a collision looks at them."""
        return bodies_of(self.line, self.bond, self.strains, self.velocities)

    def advance(self, goal: int) -> int:
        """Take steps until `goal` are done; return why it came back, see ``lines.loop``."""
        ledger = self.ledger
        most = steps_at_once(2 * self.scheme.evaluations * len(self.velocities))
        fractions = tuple(self.scheme.fractions)
        parameters = tuple(LineParameters.of(self.line, self.kernels.parameters))
        while True:
            check_time()
            until = min(goal, int(ledger.steps) + most)
            status = self.kernels.advance(
                ledger, unnamed(self.arrays), until, self.step, fractions, parameters
            )
            if status == loop.FULL:
                contacts = self.arrays.contacts
                more = np.concatenate((contacts, np.zeros_like(contacts)), axis=1)
                self.arrays = self.arrays._replace(contacts=more)
            elif status != loop.DONE or ledger.steps >= goal:
                return int(status)

    def steps_until(self, time: float) -> int:
        """Return how many steps end at a time or after it, one more than are done at least."""
        return max(int(self.ledger.steps) + 1, math.ceil(time / self.step))

    def displacements(self, position: float, strains: Array) -> Array:
        """Return u of all particles along x, from that of the first."""
        return position + np.concatenate(([0.0], np.cumsum(strains)))

    def copy(self) -> "LineInMotion":
        """Return a copy that can be moved without moving this one, without the contacts so far."""
        arrays = self.arrays._replace(
            now=_copied(self.arrays.now),
            last=_copied(self.arrays.last),
            contacts=np.zeros((3, 4 * loop.SPARE_CONTACTS)),
        )
        ledger = self.ledger.copy()
        ledger.contacts = 1
        return replace(self, ledger=ledger, arrays=arrays)

    def state_at(self, time: float) -> tuple[Array, Array]:
        """Return displacements and velocities in the step about to be done, contacts included."""
        copy = self.copy()
        missing = time - self.time
        if missing > 0.0:
            copy.step, copy.ledger.steps = missing, 0
            copy.advance(1)
        return self.displacements(float(copy.ledger.position), copy.strains), copy.velocities


def _copied(state: State) -> State:
    return State(state.strain.copy(), state.velocity.copy())


def unnamed(arrays: tuple) -> tuple:
    """Return plain tuples: named ones cost a compiled function more at each call."""
    return tuple(tuple(part) if isinstance(part, State) else part for part in arrays)
