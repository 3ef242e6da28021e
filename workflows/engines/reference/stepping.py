"""
Run one collision to its end in the reference engine, with equal steps.

Every scheme is possible; contacts are located to rounding. Solvers and runs for error bars call
`run`.
"""

import math
import time

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.end_watch import EndWatch
from chaincor.workflows.engines.ending import Ending, sound_round_trip
from chaincor.workflows.engines.outcome import MOST_ENERGY_GROWTH, Outcome
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.coarse_run import CoarseRun
from chaincor.workflows.engines.reference.finish import (
    KNOWN_MARGIN,
    End,
    LastContact,
    finish,
    run_single_particle,
    unfinished_error,
)
from chaincor.workflows.engines.reference.look_ahead import LookAhead
from chaincor.workflows.engines.reference.loops.processes import compile_in_background
from chaincor.workflows.engines.reference.moving import Motion, Stepper
from chaincor.workflows.engines.reference.recorder import Recorder
from chaincor.workflows.engines.reference.tracked import tracked_values
from chaincor.workflows.engines.whole_end import certain_at, next_look

# A contact of soft bodies may last for at most this time, in units of the contact duration of two
# free particles.
LONGEST_TOUCHES = 100.0


def run(
    problem: Problem,
    numerics: Numerics,
    frame_interval: float | None = None,
    known: Outcome | None = None,
    follow: bool = True,
) -> Outcome:
    """
    Run the collision of a scene with the scheme and step of `numerics`.

    In most runs, a look-ahead run with coarse steps shows that a contact was the last one
    (``look_ahead``). Chains that break are followed with the steps of the run.

    Parameters
    ----------
    frame_interval : float, optional
        Time between snapshots. For each snapshot, a copy of the chain is moved, so that snapshots
        change no result.
    known : Outcome, optional
        Outcome of the same collision at another step. The run will be compared with `known`, and
        continues only a little beyond the last contact of `known`.
    follow : bool
        Whether a run whose end is not proved continues until its end is argued. If False, the run
        ends after one sound round trip without a contact; this suffices for runs that are only
        compared with others.

    Raises
    ------
    UnfinishedCollisionError
        If the chain still approaches the wall after the longest time that is followed.
    BarrierError, CrossingError, BondRangeError, TimestepError
        If strains are invalid; ``finish.strain_error`` distinguishes the cases.
    """
    if problem.particles == 1 and problem.line.targets == 0 and not problem.line.soft:
        return run_single_particle(problem, numerics.scheme, numerics.timestep, frame_interval)
    moving = _at_start(problem, numerics)
    loaded = moving.stepper.kernels.loaded
    if not loaded.is_set():
        # Advancing by zero steps loads or compiles the loops before the integration is timed.
        with compile_in_background(_warm_up_coarse_steps, problem, numerics):
            moving.advance(0)
        _warm_up_coarse_steps(problem, numerics)
        loaded.set()
    collision = _Collision(problem, moving, frame_interval)
    started = time.perf_counter()
    end = collision.run(known, follow)
    seconds = time.perf_counter() - started
    run_state, last = moving.run_state, moving.arrays.last
    begin = float(run_state["first_contact"])
    quiet = sound_round_trip(problem.longest_body, problem.slow_stiffness)
    return finish(
        problem,
        LastContact(
            strains=last.strain,
            velocities=last.velocity,
            contact_times=moving.contact_times - begin,
            contact_speeds=moving.contact_speeds.copy(),
            impulses=moving.impulses.copy(),
            position=float(run_state["last_position"]),
            lasted=float(run_state["last_contact"]),
            bond_range=(
                1.0 + float(run_state["contact_min"]),
                1.0 + float(run_state["contact_max"]),
            ),
            tracked=tracked_values(moving.arrays.tracked, problem.line.soft),
        ),
        end,
        scheme=numerics.scheme,
        timestep=numerics.timestep,
        seconds=seconds,
        frames=collision.frames.collected(float(run_state["last_contact"]) - begin + quiet),
    )


def follow_on(problem: Problem, moving: Motion) -> End:
    """
    Continue the collision of bodies whose end may be argued, as :func:`run` does.

    The loop over steps has returned `bookkeeping.ARGUE`, and the end has not been searched for yet.
    The bodies are changed in place; their record of contacts may be enlarged. Return the end of the
    collision. Raises RunError as :func:`run` does.
    """
    return _Collision(problem, moving, None).run(None, True, bookkeeping.ARGUE)


def _warm_up_coarse_steps(problem: Problem, numerics: Numerics) -> None:
    """Load or compile the loop over coarse steps."""
    CoarseRun(_at_start(problem, numerics), 0.0, 1.0).fly(0.0)


def _at_start(problem: Problem, numerics: Numerics) -> Motion:
    stepper = Stepper.of(problem.line, problem.bond, numerics.scheme, numerics.timestep)
    return Motion.at_start(problem, stepper)


class _Collision:
    """Collision in progress, with its bodies, look-ahead runs and snapshots."""

    def __init__(self, problem: Problem, moving: Motion, frame_interval: float | None) -> None:
        self.problem, self.moving = problem, moving
        self.look_ahead = LookAhead(problem, moving)
        self.frames = Recorder(moving, frame_interval)
        self.watch = EndWatch(problem.longest_body, problem.bond, problem.slow_stiffness)

    def run(self, known: Outcome | None, follow: bool, left: int | None = None) -> End:
        """
        Step until the end of the collision and return it.

        `left` is the reason that a loop outside this class returned; None if no steps were taken.
        """
        problem, run_state = self.problem, self.moving.run_state
        if known is not None:
            bookkeeping.never_argue(run_state)
        while True:
            target_steps, last_step = self._target_steps(known)
            status = self.moving.advance(target_steps) if left is None else left
            left = None
            if status in (bookkeeping.OUTSIDE, bookkeeping.CROWDED):
                raise self.look_ahead.unresolved()
            if status == bookkeeping.FULL:
                self.moving.make_room()
                continue
            late = run_state["steps"] > last_step
            now, _ = self.look_ahead.times()
            if late and known is not None and not run_state["touching"]:
                return End(known.ending, now, int(run_state["evaluations"]))
            if (status == bookkeeping.ARGUE or late) and not run_state["touching"]:
                end = self._look(status, follow)
                if end is not None:
                    self.frames.record_until(end.time)
                    return end
            if status == bookkeeping.DONE:
                if late and self._patience() < now:
                    raise unfinished_error(problem, now)
                self.frames.record()

    def _target_steps(self, known: Outcome | None) -> tuple[int, float]:
        """Return the number of steps to be done, and the number after which the run is late."""
        problem, run_state, step = self.problem, self.moving.run_state, self.moving.stepper.step
        steps, interval = int(run_state["steps"]), 1.0 / problem.slow_stiffness**0.5
        if run_state["contacts"] == 0:
            # The centre of mass approaches the wall; therefore a contact will come.
            target_steps = steps + math.ceil(interval / step)
            return int(min(target_steps, self.frames.next_step())), math.inf
        if known is None:
            longest = self._patience()
        else:
            longest = float(known.contact_times[-1]) + KNOWN_MARGIN * interval
        last_step = math.ceil((longest + float(run_state["first_contact"])) / step)
        if run_state["touching"]:
            last_step = max(last_step, steps + math.ceil(interval / step))
        return int(min(last_step + 1, self.frames.next_step())), last_step

    def _patience(self) -> float:
        """Return the time since the first contact until which the bodies are followed."""
        _, last = self.look_ahead.times()
        patience = self.watch.followed_until(last)
        run_state = self.moving.run_state
        if run_state["touching"]:
            begun = float(self.moving.contact_times[-1] - run_state["first_contact"])
            patience = max(patience, begun + LONGEST_TOUCHES * self.problem.contact_duration)
        return patience

    def _look(self, status: int, follow: bool) -> End | None:
        """Return the end of the collision; None if the bodies must be followed further."""
        moving, run_state, line = self.moving, self.moving.run_state, self.problem.line
        now, last = self.look_ahead.times()
        certain = math.inf
        if status == bookkeeping.ARGUE and line.at_wall and line.cold:
            speed, momentum = float(run_state["impact_velocity"]), float(run_state["momentum"])
            if not abs(momentum) <= MOST_ENERGY_GROWTH * line.chain_masses.sum() * speed:
                # A chain leaves faster than it arrived only if the step is too long.
                raise self.look_ahead.unresolved()
            masses = None if line.unit else line.chain_masses
            state = moving.gap, moving.strain
            certain = certain_at(self.problem.bond, speed, momentum, *state, now, last, masses)
        if certain == math.inf:
            end = self.look_ahead.look(self.watch, follow)
            run_state["argue_after"] = self.watch.next_look(now, last) - last
            return end
        off, seen, evaluations = self.look_ahead.stays_clear(certain)
        if off:
            return End(Ending("proved"), seen, evaluations)
        run_state["evaluations"] = evaluations
        run_state["argue_after"] = next_look(now, last, seen) - last
        return None
