"""Solve warm chains at a hard wall to a tolerance, for many seeds and speeds together."""

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.accuracy.batching import compare_many
from chaincor.workflows.accuracy.bounded_run import BoundedRun, bounded_run, decade_within
from chaincor.workflows.accuracy.fixed_steps import usual_scheme
from chaincor.workflows.accuracy.plan import Plan
from chaincor.workflows.accuracy.reference_runs import differ, difference_to, run_reference
from chaincor.workflows.accuracy.solvers import FIXED_STEPS
from chaincor.workflows.accuracy.step_guess import STEP_SHARE, usual_step
from chaincor.workflows.accuracy.step_proof import COARSER, proved_error, usual_share
from chaincor.workflows.engines.ending import sound_round_trip
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference.batch.chains import (
    ManyRuns,
    StartStates,
    chain_energies,
)
from chaincor.workflows.engines.reference.batch.runner import Batch, supports
from chaincor.workflows.engines.rounding import arithmetic_error
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import CostError, RunError

# Least target error. Smaller target errors need single runs, which measure the amplification of
# rounding errors.
SHARPEST_GOAL = 1e-8
# Energy of the most compressed bond in a warm chain, in units of T. Only the first step depends on
# it.
_HOTTEST_BOND = 5.0
# Steps are taken from a geometric sequence with this ratio. Collisions at similar speeds therefore
# have the same step.
_STEP_LADDER = 0.8
# The first steps are guessed and cached for a geometric sequence of energies with this logarithmic
# ratio.
_ENERGY_LADDER = math.log(1.1)
# Largest step, in units of 1/frequency. Schemes begin to reach their order at twice this step. The
# limit affects only the cost.
_LARGEST_STEP = 0.33
# Collisions that need more refinements than this seldom converge.
_MOST_REFINEMENTS = 7
# A smaller error due to the step is useless, because it is below the rounding error.
_SMALLEST_ERROR = 1e-16
# The rounding error may be at most this fraction of a target error.
_ROUNDING_SHARE = 0.1

# Result of a collision. The field `met` states whether the tolerance is met; only then do the other
# fields have a meaning. They are eta and the parts of its error bar, the step, the number of
# contacts, the time between the first and the last contact, and whether the end is proved
# (otherwise it is argued).
MET = np.dtype(
    [
        ("met", bool),
        ("restitution", float),
        ("step_error", float),
        ("rounding", float),
        ("timestep", float),
        ("contacts", np.int64),
        ("last_contact_time", float),
        ("proved", bool),
    ]
)


def is_warm(planned: Plan) -> bool:
    """Return whether `WarmSolver` supports a plan."""
    problem, asked = planned.problem, planned.tolerance
    if planned.engine != "reference" or asked is None or problem.temperature is None:
        return False
    return decade_within(asked) >= SHARPEST_GOAL and supports(problem.line, problem.bond)


class WarmSolver:
    """
    Solver for warm chains, for many initial states or for the initial state of one scene.

    :func:`is_warm` must accept the plan of `problem`. All collisions have the same bonds, masses
    and tolerance. Each collision is run at H, 2 H and 1.3 H; these three runs prove the error
    (``step_proof``). The error includes amplified rounding errors, because rounding differs in
    every run.
    """

    def __init__(self, problem: Problem, tolerance: float) -> None:
        self._problem, self._line = problem, problem.line
        self._target_error = decade_within(tolerance)
        self.scheme = usual_scheme(self._target_error)
        self._rungs: dict[int, tuple[int, int]] = {}
        self._quiet = sound_round_trip(problem.particles, problem.slow_stiffness)

    @cached_property
    def batch(self) -> Batch:
        """Batch of many collisions; its loops are loaded at the first use."""
        return Batch(self._line, self._problem.bond, self.scheme)

    def share(self, velocity: float) -> int:
        """Return a number of collisions to solve together, small enough to show progress."""
        return self.batch.share(self._step(max(self._rungs_of(velocity)[0], 0)))

    def solve(self, starts: StartStates, velocities: Array) -> Any:
        """
        Solve many collisions.

        `velocities` contains the impact velocities, of shape (samples,). Return a record array of
        type `MET`. The result of a collision does not depend on the other collisions. Raises
        RunError if the batch was stopped.
        """
        rungs, last_rungs = np.array([self._rungs_of(v) for v in velocities.tolist()]).T
        found = np.zeros(len(starts), MET).view(np.recarray)
        floor = found.rounding = self._rounding(starts, velocities)
        left = (rungs >= 0) & (floor <= _ROUNDING_SHARE * self._target_error)
        tries = np.zeros(len(starts), np.int64)
        while np.any(left):
            now = np.flatnonzero(left)
            steps = np.array([self._step(rung) for rung in rungs[now].tolist()])
            begun = starts.chosen(now)
            runs, eta, errors = self._compare(begun, steps, velocities[now], floor[now])
            met = errors + floor[now] <= self._target_error
            done = now[met]
            found.met[done] = True
            found.restitution[done], found.step_error[done] = eta[met], errors[met]
            found.timestep[done] = steps[met]
            found.contacts[done], found.proved[done] = runs.counts[met], runs.proved[met]
            found.last_contact_time[done] = runs.last_contact_times[met]
            tries[now] += 1
            left[now] = ~met & (tries[now] < _MOST_REFINEMENTS) & (rungs[now] < last_rungs[now])
            # Stop if a chain that broke may have a late contact or a late end, because smaller
            # steps cannot decide about these.
            left[now[runs.settled & self._may_come_late(runs) | runs.endless]] = False
            rungs[now] = np.minimum(self._finer(rungs[now], errors, tries[now]), last_rungs[now])
        return found

    def solve_alone(self) -> BoundedRun | None:
        """Return the solution of the scene; None if the scene needs a closer examination."""
        velocity = self._problem.impact_velocity
        rung, last_rung = self._rungs_of(velocity)
        floor = float(self._rounding(StartStates.of([self._line]), np.array([velocity]))[0])
        if rung < 0 or floor > _ROUNDING_SHARE * self._target_error:
            return None
        for tries in range(1, _MOST_REFINEMENTS + 1):
            step = self._step(rung)
            runs, error, over = self._compare_alone(step, floor)
            if runs is not None and error + floor <= self._target_error:
                tried = {"timestep": step, "step_error": error}
                return bounded_run(runs[0], error, runs[1], [tried])
            if over or rung >= last_rung:
                return None
            rung = min(int(self._finer(rung, error, tries)), last_rung)
        return None

    def _step(self, rung: int) -> float:
        return _LARGEST_STEP / self._problem.fast_stiffness**0.5 * _STEP_LADDER**rung

    def _rungs_of(self, velocity: float) -> tuple[int, int]:
        """Return the first and last index of steps to try; -1 if bonds are too stiff for these."""
        energy = velocity**2 + _HOTTEST_BOND * (self._problem.temperature or 0.0)
        place = math.ceil(math.log(energy) / _ENERGY_LADDER)
        if place not in self._rungs:
            energy = math.exp(place * _ENERGY_LADDER)
            target_errors = (STEP_SHARE * self._target_error, _SMALLEST_ERROR)
            first, last = (self._rung_at(energy, target_error) for target_error in target_errors)
            self._rungs[place] = first, max(first, last)
        return self._rungs[place]

    def _rung_at(self, energy: float, target_error: float) -> int:
        problem, bond = self._problem, self._problem.bond
        strain = bond.compressed_strain(energy)
        sharpness = math.sqrt(max(1.0, float(bond.curvature(strain)) / bond.stiffness))
        if sharpness > FIXED_STEPS.sharpest:
            return -1
        step = 0.5 * usual_step(
            self.scheme, target_error / usual_share(self.scheme), problem.fast_stiffness
        )
        smaller = math.log(step / sharpness / self._step(0)) / math.log(_STEP_LADDER)
        return max(math.ceil(smaller), 0)

    def _finer(self, rung: Any, error: Any, tries: Any) -> Any:
        """Return the index of the next step to try."""
        with np.errstate(divide="ignore"):
            wanted = np.divide(STEP_SHARE * self._target_error, error)
        wanted = wanted ** (1.0 / STEP_SCHEMES[self.scheme].order)
        shrink = np.log(np.where(np.isfinite(error), wanted, 0.5)) / math.log(_STEP_LADDER)
        # A collision that amplifies the errors of steps converges only at much shorter steps. The
        # index therefore rises by at least the number of attempts so far.
        return rung + np.clip(np.ceil(shrink), tries, 5 + tries).astype(np.int64)

    def _rounding(self, starts: StartStates, velocities: Array) -> Array:
        """Return the error of eta due to rounding, as ``engines.rounding`` does."""
        translation = 0.5 * float(np.sum(self._line.chain_masses)) * velocities**2
        heat = np.maximum(chain_energies(self._line, self._problem.bond, starts) / translation, 1.0)
        return np.asarray(arithmetic_error(self._problem.particles, heat))

    def _compare(
        self, starts: StartStates, steps: Array, velocities: Array, floor: Array
    ) -> tuple[ManyRuns, Array, Array]:
        """Run at three steps; return the finest runs, with their eta and errors."""
        fine = self.batch.follow(starts, steps)
        eta, errors = np.full((2, len(steps)), np.inf)
        sound = np.flatnonzero(fine.settled & ~self._may_come_late(fine))
        if len(sound):
            chosen, of, steps = starts.chosen(sound), fine.chosen(sound), steps[sound]
            runs = [of] + [
                self.batch.compare(chosen, times * steps, of.last_contact_times)
                for times in COARSER
            ]
            compared = compare_many(
                self.scheme, steps, runs, velocities[sound], self._line, floor[sound]
            )
            eta[sound], errors[sound], _ = compared
        return fine, eta, errors

    def _may_come_late(self, runs: ManyRuns) -> NDArray[np.bool_]:
        """Return whether another contact is possible after the end of each run."""
        # An end is argued after one sound round trip without a contact. If a longer time passed
        # between two contacts of this run, another contact may also follow an argued end.
        return np.asarray((runs.longest_silences > self._quiet) & ~runs.proved)

    def _compare_alone(
        self, step: float, floor: float
    ) -> tuple[tuple[Outcome, Outcome] | None, float, bool]:
        """
        Compare three runs of the stepping engine.

        For a single chain, its steps cost half as much as steps in a batch. Return the run and the
        run at twice its step, the error, and whether smaller steps cannot help.
        """
        problem, scheme = self._problem, self.scheme
        try:
            fine = run_reference(problem, scheme, step)
            kind = fine.ending.kind
            silent = fine.longest_silence > self._quiet
            if kind == "open" or (silent and kind != "proved"):
                return None, math.inf, True
            coarse = [run_reference(problem, scheme, times * step, fine) for times in COARSER]
        except CostError:
            raise
        except RunError:
            return None, math.inf, False
        far, near = (difference_to(fine, run) for run in coarse)
        alike = not differ(fine, coarse)
        error = proved_error(scheme, fine.lasted / step, far, near, floor, alike)[0]
        return (fine, coarse[0]), float(error), False
