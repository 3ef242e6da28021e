"""Run collisions with adaptive steps, for bonds too compressed for steps of one size."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.end_watch import EndWatch, longest_collision
from chaincor.workflows.engines.ending import Ending, sound_round_trip
from chaincor.workflows.engines.fragments import Body
from chaincor.workflows.engines.outcome import Frames, Outcome
from chaincor.workflows.engines.reference import adaptive_loops as adaptive
from chaincor.workflows.engines.reference import beads, bookkeeping
from chaincor.workflows.engines.reference.adaptive_flight import STAGES, AdaptiveFlight
from chaincor.workflows.engines.reference.compile import (
    KEPT,
    LoopCompiler,
    scalar_force,
)
from chaincor.workflows.engines.reference.finish import (
    End,
    LastContact,
    allowed_strains,
    displacements_from,
    finish,
    run_single_particle,
    strain_error,
    unfinished_error,
)
from chaincor.workflows.engines.reference.line_traits import unregistered
from chaincor.workflows.engines.reference.look_ahead import follow
from chaincor.workflows.errors import RunError, TimestepError

SCHEME = "adaptive8"

# Allowed error of a single step, divided by the target error of the restitution. A collision takes
# 1e3 to 1e6 steps, whose errors mostly cancel.
LOCAL_SHARE = 0.03
# Least allowed error of a single step. Smaller error estimates would consist of rounding errors,
# which would mislead the step-size control.
FINEST_LOCAL = 1e-15

# If the logarithm of a bond length is below this value, its strain does not represent the length
# accurately. The search for the end then waits.
_LOG_LENGTH_TO_ARGUE = -20.0


# The state after a trial step may overflow. The error of this step is then not a number, and the
# step is rejected.
@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def run(problem: Problem, accuracy: float, frame_interval: float | None = None) -> Outcome:
    """
    Run the collision of a chain with adaptive steps.

    `accuracy` is the target error of the restitution; the difference from a run at a tenth of
    `accuracy` shows the error reached. Snapshots at multiples of `frame_interval` come from partial
    steps and leave the motion unchanged. Raises the errors of ``stepping.run``, and TimestepError
    if no step, however small, is accurate.
    """
    if problem.bond.only_pushes:
        return beads.run(problem, accuracy, frame_interval, SCHEME)
    if problem.particles == 1:
        return run_single_particle(problem, SCHEME, None, frame_interval)
    bond = _bond_loops(problem.bond)
    flight = _Flight(problem, bond, accuracy, frame_interval)
    flight.warm_up()
    started = time.perf_counter()
    ending = flight.run()
    seconds = time.perf_counter() - started
    run_state = flight.run_state
    times, speeds, _ = flight.arrays.contacts[:, : run_state.contacts].copy()
    lowest, highest = (bond.length_of(y) for y in (run_state.contact_min, run_state.contact_max))
    last_bonds, last_velocities = flight.split(flight.arrays.last)
    potential_energy = float(np.sum(bond.energy(last_bonds)))
    return finish(
        problem,
        LastContact(
            bond.strains(last_bonds),
            last_velocities,
            contact_times=times,
            contact_speeds=speeds,
            bond_range=(float(lowest), float(highest)),
            energy=0.5 * float(last_velocities @ last_velocities) + potential_energy,
        ),
        End(ending, float(run_state.time), int(run_state.evaluations)),
        scheme=SCHEME,
        timestep=None,
        seconds=seconds,
        frames=flight.collected(),
    )


@dataclass(frozen=True)
class BondLoops:
    """Compiled loop for one potential, and functions of the bond coordinate y."""

    advance: Callable  #: Loop over steps, see ``adaptive_loops``.
    parameters: tuple[float, ...]  #: Parameters of the force; NamedTuple.
    strains: Callable  #: Strain s as a function of y.
    length_of: Callable  #: Bond length r as a function of y.
    energy: Callable  #: Energy U as a function of y.
    logarithmic: bool  #: Whether y is ln r; otherwise y is the strain.


def _bond_loops(bond: Potential) -> BondLoops:
    log_length = bond.log_length
    if log_length is not None:
        advance = _compile(log_length.kernel, keep=True, logarithmic=True)
        return BondLoops(advance, bond.parameters, np.expm1, np.exp, log_length.energy, True)
    force = scalar_force(bond)
    if force is None:
        rates = adaptive.array_rates(bond.force)
        advance, parameters = adaptive.build_flight(rates, unregistered), bond.parameters
    else:
        advance = _compile(force.function, keep=force.keep, logarithmic=False)
        parameters = force.parameters
    return BondLoops(advance, parameters, np.array, lambda y: 1.0 + y, bond.energy, False)


@lru_cache(maxsize=KEPT)
def _compile(function: Callable, *, keep: bool, logarithmic: bool) -> Callable:
    compiler = LoopCompiler.for_force(function, keep)
    register = compiler.register
    kernel = register(function)
    bond = kernel if logarithmic else register(adaptive.strain_bond(kernel))
    rates = register(adaptive.looped_rates(bond))
    flight = adaptive.build_flight(rates, register)
    return compiler.compile(flight)


def _strain_scale(problem: Problem) -> float:
    """
    Return the scale of strain errors: v0, as for bonds of stiffness 1, but at most 1.

    For bonds that are soft at their natural length, the scale is within a factor of ten of the
    strain at which two colliding particles stop each other.
    """
    speed = problem.impact_velocity
    strain = -problem.bond.compressed_strain(speed**2)
    return min(1.0, 10.0 * strain, max(speed, 0.1 * strain)) if strain > 0.0 else min(1.0, speed)


class _Flight(AdaptiveFlight):
    """Collision in progress, with the arrays of the loops; decides when the collision is over."""

    def __init__(
        self, problem: Problem, bond: BondLoops, accuracy: float, frame_interval: float | None
    ) -> None:
        particles, speed = problem.particles, problem.impact_velocity
        self._problem, self._bond, self._interval = problem, bond, frame_interval
        state = np.zeros(2 * particles)
        state[particles:] = -speed
        state[particles] = speed
        contacts = np.zeros((3, 2 * particles + 64))
        local = max(FINEST_LOCAL, LOCAL_SHARE * accuracy)
        scale = np.full(2 * particles, local * _strain_scale(problem))
        scale[particles:] = local * speed
        slopes = np.zeros((STAGES + 1, 2 * particles))
        arrays = adaptive.AdaptiveArrays(
            state=state,
            last=state.copy(),
            contacts=contacts,
            frames=np.zeros((1 if frame_interval is None else 64, 2 * particles)),
            scale=scale,
            kept=state.copy(),
            slopes=slopes,
            trial=state.copy(),
            trial_slopes=slopes.copy(),
            part=state.copy(),
            errors=np.zeros((2, 2 * particles)),
        )
        self._not_before = 0.0
        stiffness = problem.slow_stiffness
        run_state = np.zeros(1, adaptive.RUN_STATE)[0]
        super().__init__(bond.advance, run_state, arrays, bond.parameters, particles)
        run_state.momentum = -particles * speed
        bookkeeping.argue_when_silent(run_state, stiffness)
        run_state.longest = longest_collision(particles, stiffness, 0.0)
        run_state.frame_interval = math.inf if frame_interval is None else frame_interval
        run_state.next_frame = math.inf if frame_interval is None else 0.0
        floor, ceiling = allowed_strains(problem.bond)
        run_state.strain_floor = -math.inf if bond.logarithmic else floor
        run_state.strain_ceiling = ceiling
        # The first step is only a guess, because steps that are too large are rejected and
        # shortened.
        run_state.step = 0.05 / (math.sqrt(stiffness) * max(1.0, speed))
        bookkeeping.record_contact(run_state, contacts, 0.0, speed)
        bookkeeping.note_impulse(run_state, contacts, 2.0 * speed)
        bookkeeping.note_parting(run_state, 0.0, 0.0, 0.0)

    def run(self) -> Ending:
        """Integrate until the collision ends and return its end."""
        run_state, problem = self.run_state, self._problem
        watch = EndWatch(problem.particles, problem.bond, problem.slow_stiffness)
        while True:
            status = self._advance()
            now, last = float(run_state.time), float(run_state.last_contact)
            if status == adaptive.FULL:
                self._make_room()
            elif status in (adaptive.ARGUE, adaptive.LATE):
                ending = self._look(watch)
                if ending is not None:
                    return ending
                run_state.argue_after = watch.next_look(now, last) - last
                if status == adaptive.LATE:
                    if now > watch.followed_until(last):
                        raise unfinished_error(problem, now)
                    run_state.longest = 1.01 * watch.followed_until(last)
            else:
                raise self._failure(status)

    def _look(self, watch: EndWatch) -> Ending | None:
        bonds, velocities = self.split(self.arrays.state)
        if self._bond.logarithmic and bonds.min() < _LOG_LENGTH_TO_ARGUE:
            return None
        run_state, problem = self.run_state, self._problem
        now, last = float(run_state.time), float(run_state.last_contact)
        first, strains = float(self.arrays.state[0]), self._bond.strains(bonds)
        ending = watch.look_at(now, last, [Body(first, strains, velocities)])
        quiet = sound_round_trip(problem.particles, problem.slow_stiffness)
        if ending is not None or now - last < quiet or now < self._not_before:
            return ending
        # After a sound round trip without a contact, search for the end of a broken chain with
        # fixed steps.
        shortest = float(self._bond.length_of(bonds.min()))
        along_x = np.append(first, strains), np.append(0.0, velocities)
        ahead = follow(problem, *along_x, now=now, last_contact=last, shortest=shortest)
        self._not_before = ahead.time
        return ahead.ending

    def _failure(self, status: int) -> RunError:
        run_state, problem = self.run_state, self._problem
        now = float(run_state.time)
        if status == adaptive.OUTSIDE:
            low, high = (
                float(self._bond.length_of(y)) for y in (run_state.strain_min, run_state.strain_max)
            )
            return strain_error(problem, low - 1.0, high - 1.0, now, "lower the speed")
        return TimestepError(
            f"no step resolves the {problem.label} bonds at time {now:.6g} to the required "
            "accuracy; give a larger tolerance, or lower the speed"
        )

    def split(self, state: Array) -> tuple[Array, Array]:
        """Return the bond coordinates and the velocities of a state."""
        return state[1 : self._particles], state[self._particles :]

    def collected(self) -> Frames | None:
        """Return the snapshots; None without a `frame_interval`."""
        if self._interval is None:
            return None
        count = int(self.run_state.frames)
        states = self.arrays.frames[:count]
        strains = [self._bond.strains(self.split(state)[0]) for state in states]
        return Frames(
            np.array([k * self._interval for k in range(count)]),
            np.array([displacements_from(s[0], e) for s, e in zip(states, strains, strict=True)]),
            states[:, self._particles :].copy(),
        )
