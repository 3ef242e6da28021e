"""
Run of a long chain on several cores.

A substep is a step, or the part of a step up to a contact. In each substep the effect of the wall
travels by the reach of the scheme. The head of the chain is therefore moved through some substeps
first, by the loop over whole chains. This finds the contacts and thereby the length of each
substep. Blocks of the chain then go through these substeps side by side, each with a margin on
either side that replaces the unknown state of its neighbours, so that cores synchronise once in
many substeps. Each particle is computed with the same arithmetic as in the loop over the whole
chain, so no bit depends on the number of cores or blocks.
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
# Blocks begin at multiples of this number of bonds. It is a multiple of the width of a vector loop,
# so the scalar remainder contains the same bonds as in the whole chain.
ALIGNED = 64
# A block is at least this many times as large as its margin. In a smaller block too many bonds are
# computed twice.
LEAST_MARGINS = 8
# A second core saves time if at least this many bonds move.
LEAST_ACTIVE = 6000


# ``blocks.loop`` explains these arguments of the loop.
_Block = tuple[int, int, int, int, bool]
_Scratch = tuple[State, State, State]


def pays(active: int, steps: int) -> bool:
    """Return whether several cores save time for this number of moving bonds and of steps."""
    return active >= LEAST_ACTIVE and steps >= SUBSTEPS


def load(stepper: "Stepper") -> Callable:
    """Return the loop over a block, loaded or compiled outside the timed integration."""
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
    ledger: np.record,
    arrays: motion.LineArrays,
    stepper: "Stepper",
    move: Callable,
    goal: int,
    cores: int,
) -> int:
    """
    Take steps on several cores for a chain with at least `LEAST_ACTIVE` moving bonds.

    `ledger` and `arrays` change in place as in the loop over the whole chain, to the last bit.
    `move` comes from :func:`load`; `goal` is the number of steps to reach, after the first contact.
    Return the reason for the return, see ``bookkeeping``.
    """
    state = arrays.now
    # Blocks read their margins from the old state, so they write to another one.
    states = [state, State(state.strain.copy(), state.velocity.copy())]
    head = _Head(ledger, arrays, stepper)
    blocks = _Blocks(ledger, arrays.last, stepper, move, cores)
    status = bookkeeping.DONE
    with ThreadPoolExecutor(max(cores - 1, 1)) as helpers:
        while status == bookkeeping.DONE and ledger["steps"] < goal:
            status, substeps = head.go_ahead(states[0], goal)
            known = status != bookkeeping.CROWDED
            if known and substeps.shape[1] > 0:
                known = blocks.move(states[0], states[1], substeps, helpers)
            if not known:
                # If a strain is invalid, which is rare, the loop over the whole chain reports the
                # error.
                whole = arrays._replace(now=states[0])
                until = min(goal, int(ledger["steps"]) + SUBSTEPS)
                status = stepper.advance(ledger, whole, until)
            elif substeps.shape[1] > 0:
                head.commit(ledger)
                blocks.commit(ledger, substeps)
                states.reverse()
    if states[0] is not state:
        np.copyto(state.strain, states[0].strain)
        np.copyto(state.velocity, states[0].velocity)
    return int(status)


# The head of the chain determines these variables of the whole chain.
_OF_HEAD = (
    *("position", "momentum", "first_contact", "last_contact", "argue_after"),
    *("steps", "contacts", "evaluations"),
)


class _Head:
    """Particles near the wall, which move ahead of the rest."""

    def __init__(self, ledger: np.record, arrays: motion.LineArrays, stepper: "Stepper") -> None:
        self._stepper, self._of_chain = stepper, ledger
        self._log = np.empty((2, SUBSTEPS + motion.SPARE_SUBSTEPS))
        # Even the last substep covers all bonds that the search for its contact needs.
        self._bonds = (self._log.shape[1] + 1) * stepper.scheme.reach
        own = [State(np.empty(self._bonds), np.empty(self._bonds + 1)) for _ in range(4)]
        now, last, kept, trial = own
        self._now = now
        self._arrays = arrays._replace(now=now, last=last, kept=kept, trial=trial, log=self._log)
        self._ledger = ledger.copy()

    def go_ahead(self, state: State, goal: int) -> tuple[int, Array]:
        """Move the head ahead; return the reason for the return, and the substeps until then."""
        ledger = self._ledger
        for name in _OF_HEAD:
            ledger[name] = self._of_chain[name]
        ledger["active"], ledger["substeps"] = self._bonds, 0
        # Strains at the cut are meaningless, so they are not limited.
        ledger["strain_min"] = ledger["strain_floor"] = -math.inf
        ledger["strain_max"] = ledger["strain_ceiling"] = math.inf
        self._now.strain[:] = state.strain[: self._bonds]
        self._now.velocity[:] = state.velocity[: self._bonds + 1]
        status = self._stepper.advance(ledger, self._arrays, goal)
        return status, self._log[:, : int(ledger["substeps"])]

    def commit(self, ledger: np.record) -> None:
        """Copy the variables of the head to the ledger of the chain."""
        for name in _OF_HEAD:
            ledger[name] = self._ledger[name]


class _Blocks:
    """Blocks of the chain."""

    def __init__(
        self, ledger: np.record, last: State, stepper: "Stepper", move: Callable, cores: int
    ) -> None:
        self._ledger, self._last, self._cores = ledger, last, cores
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
        ledger, stepper = self._ledger, self._stepper
        limits = (
            float(ledger["strain_min"]),
            float(ledger["strain_max"]),
            float(ledger["strain_floor"]),
            float(ledger["strain_ceiling"]),
            motion.FRONT_THRESHOLD * float(ledger["impact_velocity"]),
            float(ledger["contacts"]),
        )
        blocks = self._cut(substeps.shape[1])
        states = old, new, self._last
        self._found = np.zeros((len(blocks), loop.OUTSIDE + 1))
        self._make_room(blocks, substeps.shape[1])
        todo = iter(range(len(blocks)))

        def work(todo: Iterator[int]) -> None:
            # All threads share one iterator; the iterator of a range is never in two threads at
            # once.
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

    def commit(self, ledger: np.record, substeps: Array) -> None:
        """Copy the extreme strains of the blocks to the ledger, in any order of blocks."""
        found = self._found
        ledger["strain_min"] = np.min(found[:, loop.LOW])
        ledger["strain_max"] = np.max(found[:, loop.HIGH])
        ledger["active"] = int(found[-1, loop.ACTIVE])
        if substeps[1].any():
            ledger["contact_min"] = np.min(found[:, loop.CONTACT_LOW])
            ledger["contact_max"] = np.max(found[:, loop.CONTACT_HIGH])

    def _cut(self, substeps: int) -> list[_Block]:
        """Return blocks of about equal work, as many for each core."""
        active = int(self._ledger.active)
        margin = ALIGNED * math.ceil(substeps * self._stepper.scheme.reach / ALIGNED)
        cores = max(1, min(self._cores, active // (LEAST_MARGINS * margin)))
        # Python can react to Ctrl-C only between blocks.
        most = steps_at_once(int(self._ledger.step_evaluations) * substeps)
        count = cores * math.ceil(active / (cores * most))
        # The last block ends with the moving bonds and grows with the front.
        ends = [ALIGNED * round(active * k / count / ALIGNED) for k in range(count)] + [active]
        return [
            (first, end, max(0, first - margin), min(active, end + margin), end == active)
            for first, end in pairwise(ends)
        ]

    def _make_room(self, blocks: list[_Block], substeps: int) -> None:
        """Allocate room for the bonds of each block and for bonds that the front reaches."""
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
