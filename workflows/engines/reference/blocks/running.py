"""
A long chain on several cores.

What the wall does to a chain travels by the reach of a scheme in each substep: a step, or what a
contact leaves of it. The head of the chain is therefore carried through some substeps ahead of all
others, by the loop of whole chains, which finds the contacts and thereby how long each substep is.
Then blocks of the chain go through these substeps side by side, each with a margin on either side
that makes up for what it does not know of its neighbours: cores meet once in many substeps. All
particles go through the arithmetic of the loop over the whole chain, so that no bit depends on the
number of cores or of blocks.
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

# Substeps after which cores meet.
SUBSTEPS = 16
# Blocks begin at multiples of so many bonds: more than a vector loop does at once, so that bonds
# which it leaves over, to be done one by one, are those that it leaves over in the whole chain.
ALIGNED = 64
# A block has so many times its margin: less, and what is computed twice costs too much.
LEAST_MARGINS = 8
# Bonds in motion from which a second core pays.
LEAST_ACTIVE = 6000


# See ``blocks.loop``.
_Block = tuple[int, int, int, int, bool]
_Scratch = tuple[State, State, State]


def pays(active: int, steps: int) -> bool:
    """Return whether several cores pay for so many bonds in motion, and steps to take."""
    return active >= LEAST_ACTIVE and steps >= SUBSTEPS


def load(stepper: "Stepper") -> Callable:
    """Return the loop over a block, loaded or compiled, which is not integration."""
    assert stepper.kernels.loop is not None
    move = stepper.kernels.loop(loop.build_move, stepper.scheme.build_step)
    state, nothing = State(np.zeros(1), np.zeros(2)), np.zeros((2, 0))
    move(
        *((state, state, state), (state, state, state)),
        *((0, 1, 0, 1, True), nothing, (0.0,) * 5),
        *(stepper.rule, np.zeros(loop.OUTSIDE + 1)),
    )
    return move


def advance(
    ledger: np.record,
    arrays: motion.Arrays,
    stepper: "Stepper",
    move: Callable,
    goal: int,
    cores: int,
) -> int:
    """
    Take steps of a chain of which at least `LEAST_ACTIVE` bonds are in motion, on some cores.

    Ledger and arrays are changed in place as by the loop over the whole chain, to the last bit.
    `move` comes from :func:`load`; `goal` is how many steps shall be done, from the first contact
    on. Returns why it came back, see ``bookkeeping``.
    """
    state = arrays.now
    # Blocks read the margins of each other from the state before: they write another one.
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
                # Seldom, and then the loop over the whole chain tells it by name.
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


# What the head of a chain knows of the whole.
_OF_HEAD = (
    *("position", "momentum", "first_contact", "last_contact", "argue_after"),
    *("steps", "contacts", "evaluations"),
)


class _Head:
    """The particles near the wall, which go ahead."""

    def __init__(self, ledger: np.record, arrays: motion.Arrays, stepper: "Stepper") -> None:
        self._stepper, self._of_chain = stepper, ledger
        self._log = np.empty((2, SUBSTEPS + motion.SPARE_SUBSTEPS))
        # The last substep still knows all that the search for a contact in it does.
        self._bonds = (self._log.shape[1] + 1) * stepper.scheme.reach
        own = [State(np.empty(self._bonds), np.empty(self._bonds + 1)) for _ in range(4)]
        now, last, kept, trial = own
        self._now = now
        self._arrays = arrays._replace(now=now, last=last, kept=kept, trial=trial, log=self._log)
        self._ledger = ledger.copy()

    def go_ahead(self, state: State, goal: int) -> tuple[int, Array]:
        """Return why it came back, and the substeps until then."""
        ledger = self._ledger
        for name in _OF_HEAD:
            ledger[name] = self._of_chain[name]
        ledger["active"], ledger["substeps"] = self._bonds, 0
        # Where it is cut off, strains mean nothing.
        ledger["strain_min"] = ledger["strain_floor"] = -math.inf
        ledger["strain_max"] = ledger["strain_ceiling"] = math.inf
        self._now.strain[:] = state.strain[: self._bonds]
        self._now.velocity[:] = state.velocity[: self._bonds + 1]
        status = self._stepper.advance(ledger, self._arrays, goal)
        return status, self._log[:, : int(ledger["substeps"])]

    def commit(self, ledger: np.record) -> None:
        """Let the chain know what its head does."""
        for name in _OF_HEAD:
            ledger[name] = self._ledger[name]


class _Blocks:
    """The chain in blocks."""

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
        """Carry all blocks through substeps; return False where a strain is not allowed."""
        ledger, stepper = self._ledger, self._stepper
        limits = (
            float(ledger["strain_min"]),
            float(ledger["strain_max"]),
            float(ledger["strain_floor"]),
            float(ledger["strain_ceiling"]),
            motion.FRONT_THRESHOLD * float(ledger["impact_velocity"]),
        )
        blocks = self._cut(substeps.shape[1])
        states = old, new, self._last
        self._found = np.zeros((len(blocks), loop.OUTSIDE + 1))
        self._make_room(blocks, substeps.shape[1])
        todo = iter(range(len(blocks)))

        def work(todo: Iterator[int]) -> None:
            # All threads draw from one iterator: that of a range is never in two of them at once.
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
        """Let the chain know what its blocks met; smallest and largest know no order."""
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
        # Python, which hears Ctrl-C, runs between blocks.
        most = steps_at_once(int(self._ledger.step_evaluations) * substeps)
        count = cores * math.ceil(active / (cores * most))
        # The last one ends with the bonds in motion, and takes up what the front reaches.
        ends = [ALIGNED * round(active * k / count / ALIGNED) for k in range(count)] + [active]
        return [
            (first, end, max(0, first - margin), min(active, end + margin), end == active)
            for first, end in pairwise(ends)
        ]

    def _make_room(self, blocks: list[_Block], substeps: int) -> None:
        """See to it that each block has room for its bonds, and for those the front reaches."""
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
