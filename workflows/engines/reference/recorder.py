"""Record snapshots of a motion at multiples of an interval after the first contact."""

import math

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.outcome import Frames
from chaincor.workflows.engines.reference.finish import displacements_from
from chaincor.workflows.engines.reference.moving import Motion


class Recorder:
    """
    Recorder of snapshots; it moves copies of the bodies, so that snapshots change no result.

    The caller alternates between taking steps and calling :meth:`record`. If the interval is None,
    no snapshots are taken.
    """

    def __init__(self, moving: Motion, interval: float | None) -> None:
        self._moving, self._step, self._interval = moving, moving.stepper.step, interval
        self._before: Motion | None = None
        self._times: list[float] = []
        self._states: list[tuple[Array, Array]] = []

    def _next_time(self) -> float:
        """Return the time of the next snapshot, counted from the start of the motion."""
        run_state = self._moving.run_state
        if self._interval is None or run_state["contacts"] == 0:
            return math.inf
        return float(run_state["first_contact"]) + len(self._times) * self._interval

    def next_step(self) -> float:
        """Return the number of steps to be done before :meth:`record` is called."""
        if self._interval is None:
            return math.inf
        steps = int(self._moving.run_state["steps"])
        if self._moving.run_state["contacts"] == 0:
            self._before = self._moving.copy()
            return steps + 1
        return max(steps, self._next_time() // self._step)

    def record(self) -> None:
        """Take all snapshots within the next step, or within the step of the first contact."""
        begun = int(self._moving.run_state["steps"])
        while self._next_time() // self._step <= begun:
            now = self._next_time()
            source = self._moving
            if now < begun * self._step and self._before is not None:
                source = self._before
            self._take(source, now)

    def _take(self, source: Motion, now: float) -> None:
        copy = source.copy()
        # Take one step over the missing time, including its contacts.
        missing = now - float(copy.run_state["steps"] * self._step)
        copy.stepper = copy.stepper.of_size(max(missing, 0.0))
        copy.advance(int(copy.run_state["steps"]) + 1)
        self._times.append(now)
        displacements = displacements_from(float(copy.run_state["position"]), copy.strain)
        self._states.append((displacements, copy.velocity))

    def record_until(self, end: float) -> None:
        """Take all snapshots until `end` after the first contact; no more contacts come."""
        run_state = self._moving.run_state
        run_state["argue_after"] = math.inf
        until = float(run_state["first_contact"]) + end
        while self._next_time() <= until:
            self._moving.advance(int(self.next_step()))
            self.record()

    def collected(self, until: float) -> Frames | None:
        """Return the snapshots until `until` after the first contact; None without an interval."""
        if self._interval is None:
            return None
        begin = float(self._moving.run_state["first_contact"])
        count = sum(moment - begin <= until for moment in self._times)
        times = np.array(self._times[:count]) - begin
        return Frames.of(self._moving.line, times, *zip(*self._states[:count], strict=True))
