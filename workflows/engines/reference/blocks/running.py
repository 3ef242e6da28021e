"""
Run a long chain on several cores.

A substep is a step, or the part of a step up to a contact. In each substep, the effect of the wall
travels by the reach of the scheme. The head of the chain, the particles near the wall, is therefore
moved through some substeps first, by the loop over whole chains. This motion determines the
contacts, and with them the length of each substep. Blocks of the chain then take the same substeps
side by side. Each block has a margin on either side, which replaces the unknown state of its
neighbours. Cores therefore synchronise only once in many substeps. The arithmetic for each particle
is the same as in the loop over the whole chain; therefore no bit of the result depends on the
number of cores or blocks.
"""

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.reference import bookkeeping, motion
from chaincor.workflows.engines.reference.blocks import loop
from chaincor.workflows.engines.reference.stages import State
from chaincor.workflows.engines.time_limit import steps_at_once

if TYPE_CHECKING:
    from chaincor.workflows.engines.reference.moving import Stepper

# The cores synchronise after this many substeps.
SUBSTEPS = 16
# Blocks begin at multiples of this number of bonds. The number is a multiple of the width of a
# vector loop. The scalar remainder then contains the same bonds as in the whole chain.
ALIGNED = 64
# A block is at least this many times as long as its margin. With smaller blocks, too many bonds are
# computed twice.
LEAST_MARGINS = 8
# Several cores save time only if at least this many bonds move.
LEAST_ACTIVE = 6000


# ``blocks.loop`` explains these types of arguments.
_Block = tuple[int, int, int, int, bool]
_Scratch = tuple[State, State, State]


def pays(active: int, steps: int) -> bool:
    """Return whether several cores save time for these numbers of moving bonds and steps."""
    return active >= LEAST_ACTIVE and steps >= SUBSTEPS


def load(stepper: "Stepper") -> Callable:
    """Load or compile the loop over a block, outside the timed integration, and return it."""
    assert stepper.kernels.loop is not None
    move = stepper.kernels.loop(loop.build_move, stepper.scheme.build_step)
    state, nothing = State(np.zeros(1), np.zeros(2)), np.zeros((2, 0))
    move(
        *((state, state, state), (state, state, state)),
        *((0, 1, 0, 1, True), nothing, (0.0,) * 6),
        *(stepper.rule, np.zeros(loop.OUTSIDE + 1)),
    )
    return move


def advance(
    run_state: np.record,
    arrays: motion.LineArrays,
    stepper: "Stepper",
    move: Callable,
    target_steps: int,
    cores: int,
) -> int:
    """
    Take steps on several cores for a chain with at least `LEAST_ACTIVE` moving bonds.

    `run_state` and `arrays` change in place, exactly as in the loop over the whole chain. `move` is
    the loop from :func:`load`. `target_steps` is the number of steps to be done; the first contact
    must be over. Return the reason for the return, see ``bookkeeping``.
    """
    state = arrays.now
    # Blocks read their margins from the old state; therefore they write to a second state.
    states = [state, State(state.strain.copy(), state.velocity.copy())]
    head = _Head(run_state, arrays, stepper)
    blocks = _Blocks(run_state, arrays.last, stepper, move, cores)
    status = bookkeeping.DONE
    with ThreadPoolExecutor(max(cores - 1, 1)) as helpers:
        while status == bookkeeping.DONE and run_state["steps"] < target_steps:
            status, substeps = head.go_ahead(states[0], target_steps)
            known = status != bookkeeping.CROWDED
            if known and substeps.shape[1] > 0:
                known = blocks.move(states[0], states[1], substeps, helpers)
            if not known:
                # If a strain is invalid, which is rare, the loop over the whole chain repeats the
                # steps and reports the error.
                whole = arrays._replace(now=states[0])
                until = min(target_steps, int(run_state["steps"]) + SUBSTEPS)
                status = stepper.advance(run_state, whole, until)
            elif substeps.shape[1] > 0:
                head.commit(run_state)
                blocks.commit(run_state, substeps)
                states.reverse()
    if states[0] is not state:
        np.copyto(state.strain, states[0].strain)
        np.copyto(state.velocity, states[0].velocity)
    return int(status)


# The head of the chain determines these variables for the whole chain.
_OF_HEAD = (
    *("position", "momentum", "first_contact", "last_contact", "argue_after"),
    *("steps", "contacts", "evaluations"),
)


class _Head:
    """Particles near the wall, which are moved before the rest of the chain."""

    def __init__(self, run_state: np.record, arrays: motion.LineArrays, stepper: "Stepper") -> None:
        self._stepper, self._of_chain = stepper, run_state
        self._log = np.empty((2, SUBSTEPS + motion.SPARE_SUBSTEPS))
        # With this number of bonds, even the last substep has all bonds that the search for a
        # contact needs.
        self._bonds = (self._log.shape[1] + 1) * stepper.scheme.reach
        own = [State(np.empty(self._bonds), np.empty(self._bonds + 1)) for _ in range(4)]
        now, last, kept, trial = own
        self._now = now
        self._arrays = arrays._replace(now=now, last=last, kept=kept, trial=trial, log=self._log)
        self._run_state = run_state.copy()

    def go_ahead(self, state: State, target_steps: int) -> tuple[int, Array]:
        """Move the head; return the reason for the return, and the substeps taken."""
        run_state = self._run_state
        for name in _OF_HEAD:
            run_state[name] = self._of_chain[name]
        run_state["active"], run_state["substeps"] = self._bonds, 0
        # The last strains of the moving part are meaningless; the limits of strains are therefore
        # switched off.
        run_state["strain_min"] = run_state["strain_floor"] = -math.inf
        run_state["strain_max"] = run_state["strain_ceiling"] = math.inf
        self._now.strain[:] = state.strain[: self._bonds]
        self._now.velocity[:] = state.velocity[: self._bonds + 1]
        status = self._stepper.advance(run_state, self._arrays, target_steps)
        return status, self._log[:, : int(run_state["substeps"])]

    def commit(self, run_state: np.record) -> None:
        """Copy the variables of the head to the run state of the chain."""
        for name in _OF_HEAD:
            run_state[name] = self._run_state[name]


class _Blocks:
    """Blocks of the chain, which several cores move."""

    def __init__(
        self, run_state: np.record, last: State, stepper: "Stepper", move: Callable, cores: int
    ) -> None:
        self._run_state, self._last, self._cores = run_state, last, cores
        self._stepper, self._move = stepper, move
        self._found = np.empty((0, loop.OUTSIDE + 1))
        self._scratch: list[_Scratch] = []

    def move(
        self,
        old: State,
        new: State,
        substeps: Array,
        helpers: ThreadPoolExecutor,
    ) -> bool:
        """Move all blocks through substeps; return False if a strain is not allowed."""
        run_state, stepper = self._run_state, self._stepper
        limits = (
            float(run_state["strain_min"]),
            float(run_state["strain_max"]),
            float(run_state["strain_floor"]),
            float(run_state["strain_ceiling"]),
            motion.FRONT_THRESHOLD * float(run_state["impact_velocity"]),
            float(run_state["contacts"]),
        )
        blocks = self._cut(substeps.shape[1])
        states = old, new, self._last
        self._found = np.zeros((len(blocks), loop.OUTSIDE + 1))
        self._make_room(blocks, substeps.shape[1])
        todo = iter(range(len(blocks)))

        def work(todo: Iterator[int]) -> None:
            # All threads share one iterator. The iterator of a range gives each element to only one
            # thread.
            for k in todo:
                self._move(
                    states,
                    self._scratch[k],
                    blocks[k],
                    substeps,
                    limits,
                    stepper.rule,
                    self._found[k],
                )

        others = [helpers.submit(work, todo) for _ in range(1, min(self._cores, len(blocks)))]
        work(todo)
        for other in others:
            other.result()
        return not self._found[:, loop.OUTSIDE].any()

    def commit(self, run_state: np.record, substeps: Array) -> None:
        """Copy the extreme strains of all blocks to the run state."""
        found = self._found
        run_state["strain_min"] = np.min(found[:, loop.LOW])
        run_state["strain_max"] = np.max(found[:, loop.HIGH])
        run_state["active"] = int(found[-1, loop.ACTIVE])
        if substeps[1].any():
            run_state["contact_min"] = np.min(found[:, loop.CONTACT_LOW])
            run_state["contact_max"] = np.max(found[:, loop.CONTACT_HIGH])

    def _cut(self, substeps: int) -> list[_Block]:
        """Return blocks of about equal work, the same number for each core."""
        active = int(self._run_state.active)
        margin = ALIGNED * math.ceil(substeps * self._stepper.scheme.reach / ALIGNED)
        cores = max(1, min(self._cores, active // (LEAST_MARGINS * margin)))
        # Python can react to Ctrl-C only between blocks.
        most = steps_at_once(int(self._run_state.step_evaluations) * substeps)
        count = cores * math.ceil(active / (cores * most))
        # The last block ends at the last bond in motion and grows with the front.
        ends = [ALIGNED * round(active * k / count / ALIGNED) for k in range(count)] + [active]
        return [
            (first, end, max(0, first - margin), min(active, end + margin), end == active)
            for first, end in pairwise(ends)
        ]

    def _make_room(self, blocks: list[_Block], substeps: int) -> None:
        """Allocate room for the bonds of each block and for bonds that the front will reach."""
        needed = (
            max(stop - begin for _, _, begin, stop, _ in blocks) + substeps * motion.FRONT_BLOCK
        )
        room = len(self._scratch[0][0][0]) if self._scratch else 0
        if room < needed:
            self._scratch.clear()
            room = needed + needed // 4  # the front makes blocks grow
        while len(self._scratch) < len(blocks):
            one, another, trial = (State(np.empty(room), np.empty(room + 1)) for _ in range(3))
            self._scratch.append((one, another, trial))
