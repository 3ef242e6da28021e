"""Store the bodies in motion in the form that the loops of the stepping engine need."""

import math
from dataclasses import dataclass, replace

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.end_watch import bodies_of
from chaincor.workflows.engines.fragments import Body
from chaincor.workflows.engines.reference import bookkeeping, events, motion
from chaincor.workflows.engines.reference.blocks import running
from chaincor.workflows.engines.reference.finish import allowed_strains
from chaincor.workflows.engines.reference.kernels import Kernels, kernels_for
from chaincor.workflows.engines.reference.line_traits import LineParameters, LineTraits
from chaincor.workflows.engines.reference.loops.processes import cores
from chaincor.workflows.engines.reference.stages import State
from chaincor.workflows.engines.reference.tracked import TRACKED
from chaincor.workflows.engines.schemes import STEP_SCHEMES, StepCoefficients, StepScheme
from chaincor.workflows.engines.time_limit import check_time, steps_at_once


@dataclass(frozen=True)
class Stepper:
    """Everything that a step of given bodies needs: scheme, step H and loops."""

    line: Line  #: Bodies.
    bond: Potential  #: Potential of all bonds.
    kernels: Kernels  #: Loops.
    #: Coefficients of the scheme and parameters of the bonds. If the masses or the contact are not
    #: standard, their parameters are included.
    rule: StepCoefficients
    scheme: StepScheme  #: Scheme of a step.
    step: float  #: Whole step H.

    @classmethod
    def of(cls, line: Line, bond: Potential, scheme: str, step: float) -> "Stepper":
        """
        Return a stepper for a scheme, a step H and the bodies in `line`.

        The loops for the bond are compiled or loaded if this process does not have them yet.
        """
        kind, made_of = LineTraits.of(line), STEP_SCHEMES[scheme]
        kernels = kernels_for(bond, made_of, kind)
        parameters: tuple = kernels.parameters
        if not kind.unit:
            parameters = LineParameters.of(line, parameters)
        return cls(
            line, bond, kernels, StepCoefficients(made_of.fractions, parameters), made_of, step
        )

    def of_size(self, step: float) -> "Stepper":
        """Return a stepper with the same scheme and another step length."""
        return replace(self, step=step)

    def advance(self, run_state: np.record, arrays: motion.LineArrays, target_steps: int) -> int:
        """Take steps with the loop over all bonds, see ``motion``."""
        return int(self.kernels.advance(run_state, arrays, target_steps, self.step, self.rule))


@dataclass
class Motion:
    """Bodies in motion, with all arrays of their loops."""

    stepper: Stepper  #: Steps that move the bodies.
    run_state: np.record  #: Scalar variables of the run, see ``bookkeeping``.
    #: Current state, state right after the last contact, record of contacts, and scratch.
    arrays: motion.LineArrays

    @property
    def line(self) -> Line:
        """Bodies along x."""
        return self.stepper.line

    @property
    def strain(self) -> Array:
        """Bond lengths less one, including the gap between two bodies; may be changed in place."""
        return self.arrays.now.strain

    @property
    def velocity(self) -> Array:
        """Velocities of all particles along x, without a hard wall; may be changed in place."""
        return self.arrays.now.velocity

    @property
    def at_wall(self) -> bool:
        """Whether the target is a hard wall; the gap is then the first particle's position."""
        return self.line.at_wall

    @property
    def gap(self) -> float:
        """Gap between the bodies."""
        return float(self.run_state["position"] if self.at_wall else self.strain[self.line.gap])

    @property
    def closing(self) -> float:
        """Closing speed of the gap."""
        if self.at_wall:
            return -float(self.velocity[0])
        return float(self.velocity[self.line.gap] - self.velocity[self.line.first])

    @property
    def contact_times(self) -> Array:
        """Times of the contacts since the start."""
        return self.arrays.contacts[0, : self.run_state["contacts"]]

    @property
    def contact_speeds(self) -> Array:
        """Closing speeds of the contacts."""
        return self.arrays.contacts[1, : self.run_state["contacts"]]

    @property
    def impulses(self) -> Array:
        """Impulses on the chain at the contacts."""
        return self.arrays.contacts[2, : self.run_state["contacts"]]

    @classmethod
    def at_start(cls, problem: Problem, stepper: Stepper) -> "Motion":
        """
        Return the bodies of a scene at t = 0, after the first contact if they touch and approach.

        The bodies have at least one bond. In a cold chain at a hard wall, only the bonds near the
        wall move.
        """
        for known, scheme, start in _last_start:
            if known is problem and scheme is stepper.scheme:
                return start._renewed(stepper)
        line = problem.line
        moving = cls.in_state(stepper, line.strains, line.velocities, problem.impact_velocity)
        moving._meet()
        moving.start_front()
        _last_start[:] = [(problem, stepper.scheme, moving)]
        return moving._renewed(stepper)

    @classmethod
    def in_state(
        cls, stepper: Stepper, strains: Array, velocities: Array, speed: float
    ) -> "Motion":
        """
        Return bodies in any given state, at t = 0, before any contact; all bonds move.

        `strains`, including the gap, and `velocities` are along x as in a `Line`. `speed` is v0;
        the estimates of likely contacts and of the front of a cold chain use it.
        """
        line, bond, scheme = stepper.line, stepper.bond, stepper.scheme
        at_wall = line.at_wall
        # The target's particle at the contact starts at its natural position.
        position = float(strains[0]) if at_wall else -float(np.sum(strains[: line.gap]))
        run_state = np.zeros(1, bookkeeping.RUN_STATE)[0]
        run_state["momentum"] = line.reduced_mass * line.separation(velocities)
        bonds, masses = strains[1:], line.chain_masses
        if at_wall:
            strains, velocities = bonds, velocities[1:]
        else:
            bonds = np.delete(strains, line.gap)
            masses = np.concatenate((np.zeros(line.first), masses))
        gap = -1 if at_wall else line.gap
        now = State.room(len(strains))
        now.strain[:], now.velocity[:] = strains, velocities
        begin = max(0, gap - scheme.reach)
        end = min(len(velocities), gap + scheme.reach + 2)
        run_state["position"] = position
        run_state["impact_velocity"] = speed
        run_state["contact_mass"] = line.contact_mass
        run_state["soft"] = line.soft
        bookkeeping.argue_when_silent(run_state, bond.stiffness / line.lightest)
        run_state["shortest_share"] = 1.0 if line.contact.smooth else events.SHORTEST_SHARE
        run_state["grading"] = events.GRADING
        run_state["strain_floor"], run_state["strain_ceiling"] = allowed_strains(bond)
        if bonds.size > 0:
            run_state["strain_min"] = run_state["contact_min"] = float(np.min(bonds))
            run_state["strain_max"] = run_state["contact_max"] = float(np.max(bonds))
        run_state["step_evaluations"] = scheme.evaluations
        run_state["active"] = len(strains)
        last, kept, trial = (now.copied() for _ in range(3))
        contacts = np.zeros((3, 2 * len(velocities) + 2 * bookkeeping.SPARE_CONTACTS))
        arrays = motion.LineArrays(
            now=now,
            last=last,
            kept=kept,
            near=State.room(end - begin - 1),
            trial=trial,
            contacts=contacts,
            masses=masses,
            tracked=np.zeros(len(TRACKED)),
            window=np.array([begin, end]),
            log=np.empty((2, 0)),
        )
        return cls(stepper, run_state, arrays)

    def _renewed(self, stepper: Stepper) -> "Motion":
        """Return a copy with separate arrays and with another stepper of the same scheme."""
        old = self.arrays
        arrays = old._replace(
            now=old.now.copied(),
            last=old.last.copied(),
            kept=old.kept.copied(),
            near=State.room(len(old.near.strain)),
            trial=old.trial.copied(),
            contacts=old.contacts.copy(),
            tracked=old.tracked.copy(),
        )
        return Motion(stepper, self.run_state.copy(), arrays)

    def start_front(self) -> None:
        """Restrict the motion of a cold chain to the bonds near a hard wall."""
        if self.at_wall and self.line.cold:
            reach = len(self.arrays.near.strain)
            blocks = math.ceil(max(reach, motion.FRONT_MARGIN + 1) / motion.FRONT_BLOCK)
            self.run_state["active"] = min(len(self.strain), blocks * motion.FRONT_BLOCK)

    def _meet(self) -> None:
        """Apply the first contact if the bodies touch and approach each other."""
        line, run_state, velocity = self.line, self.run_state, self.velocity
        closing = self.closing
        if self.gap != 0.0 or closing <= 0.0:
            return
        given = 2.0 * line.contact_mass * closing
        # This code repeats `bookkeeping.record_contact`, because a call in Python would take a
        # tenth of the time of a short collision.
        self.arrays.contacts[:, 0] = 0.0, closing, given
        run_state["contacts"] = 1
        if line.soft:
            run_state["touching"] = 1
            run_state["chain_momentum"] = float(line.chain_masses @ velocity[line.first :])
        else:
            if self.at_wall:
                velocity[0] = closing
            else:
                velocity[line.gap] -= given * line.inverse_masses[line.gap]
                velocity[line.first] += given * line.inverse_masses[line.first]
            run_state["momentum"] += given
            run_state["argue_after"] = run_state["argue_first"]
        run_state["last_position"] = run_state["position"]
        np.copyto(self.arrays.last.strain, self.strain)
        np.copyto(self.arrays.last.velocity, velocity)

    def along_x(self) -> tuple[Array, Array]:
        """Return the strains, including the gap, and the velocities along x as in a `Line`."""
        if not self.at_wall:
            return self.strain, self.velocity
        return np.append(self.gap, self.strain), np.append(0.0, self.velocity)

    def bodies(self) -> list[Body]:
        """Return the bodies in the form that the search for the end needs."""
        line = self.line
        if not self.at_wall:
            return bodies_of(line, self.stepper.bond, self.strain, self.velocity)
        # This is equivalent to `bodies_of` and eight times as fast, which matters for short chains.
        masses = None if line.unit else line.chain_masses
        return [Body(self.gap, self.strain, self.velocity, masses)]

    def copy(self, room: int = 2 * bookkeeping.SPARE_CONTACTS) -> "Motion":
        """
        Return an independent copy with room for `room` contacts.

        The copy has at most one recorded contact, and shares the scratch arrays.
        """
        run_state = self.run_state.copy()
        run_state["contacts"] = min(int(run_state["contacts"]), 1)
        own = self.arrays._replace(
            now=self.arrays.now.copied(),
            last=self.arrays.last.copied(),
            tracked=self.arrays.tracked.copy(),
            contacts=np.zeros((3, room)),
        )
        return Motion(self.stepper, run_state, own)

    def after_last_contact(self) -> "Motion":
        """Return a copy in the state right after the last contact, at t = 0."""
        moving, last = self.copy(), self.arrays.last
        moving.strain[:], moving.velocity[:] = last.strain, last.velocity
        run_state = moving.run_state
        run_state["position"] = run_state["last_position"]
        run_state["first_contact"] = run_state["last_contact"] = 0.0
        run_state["steps"] = 0
        return moving

    def make_room(self) -> None:
        """Double the room for contacts."""
        contacts = self.arrays.contacts
        more = np.concatenate((contacts, np.zeros_like(contacts)), axis=1)
        self.arrays = self.arrays._replace(contacts=more)

    def advance(self, target_steps: int) -> int:
        """Take steps until `target_steps` are done; return the reason, see ``bookkeeping``."""
        stepper, run_state, arrays = self.stepper, self.run_state, self.arrays
        long = self.at_wall and len(self.strain) >= running.LEAST_ACTIVE
        count = cores() if long else 1
        move = running.load(stepper) if count > 1 and stepper.kernels.compiled else None
        most = steps_at_once(stepper.scheme.evaluations * len(self.strain))
        while True:
            check_time()
            steps = int(run_state["steps"])
            if move is not None and running.pays(int(run_state["active"]), target_steps - steps):
                return running.advance(run_state, arrays, stepper, move, target_steps, count)
            status = stepper.advance(run_state, arrays, min(target_steps, steps + most))
            if status != bookkeeping.DONE or run_state["steps"] >= target_steps:
                return status


# Last problem, its scheme and its initial motion, cached for runs of one collision at several
# steps.
_last_start: list[tuple[Problem, StepScheme, Motion]] = []
