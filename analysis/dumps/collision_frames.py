"""The frames of a collision, from its start on."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.dumps.chain_frames import ChainLayout, ChainState
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.start import Start, find_moving_start, find_start
from chaincor.lammps_inputs.errors import InputError


class CollisionFrames:
    """
    The frames of a collision in order of time, and what the first of them says.

    Parameters
    ----------
    frames : iterator of DumpFrame
        Frames of one run.
    timestep : float or None
        Simulated time per step, for dumps that do not carry the time, and only for them.
    targets : int
        Particles of a free target; 0 for a wall.

    Attributes
    ----------
    first, last : DumpFrame
        First frame, and the last that has been read.
    last_interval : int
        Steps between the last two.
    layout : ChainLayout
        Layout of the dump.
    opening : ChainState
        The state that the first frame holds.
    resolution : float
        Half-width of the interval that a velocity printed in it stands for.
    start : Start
        What it says.
    """

    def __init__(self, frames: Iterator[DumpFrame], timestep: float | None, targets: int = 0):
        self._frames = frames
        self._timestep = timestep
        self.first = self.last = next(frames)
        self.last_interval = 0
        self.layout = ChainLayout.from_frame(self.first, targets)
        if self.layout.time_known and timestep is not None:
            raise InputError(
                f"the dump carries the time, and a timestep of {timestep:g} is given; expected "
                "one of them: drop the timestep (--timestep)"
            )
        if not self.layout.time_known and timestep is None:
            raise InputError(
                "the dump counts steps and does not carry the time; give the timestep of the run "
                "(--timestep), or dump the time as a column v_time"
            )
        self.opening = self.layout.state(self.first, timestep)
        resolution = self.first.resolution("vx", self.first.significant_digits())
        self.resolution = float(np.max(resolution))
        # As the target sees it, whose particles all rest if it is cold.
        target = self.opening.target_velocities
        relative = self.opening.velocities - (float(target[0]) if target.size else 0.0)
        self.start = find_start(relative, resolution)
        if target.size and (self.start.kind != "incoming" or np.any(target != target[0])):
            self.start = Start("late", None)

    @property
    def digits(self) -> int:
        """Significant digits of the dump; the first frame alone may hold round numbers only."""
        return max(self.first.significant_digits(), self.last.significant_digits())

    @property
    def begins_at_contact(self) -> bool:
        """Whether the first frame is that of the first contact, before or after the turn."""
        if self.start.kind in ("reflected", "turned"):
            return True
        arrives = self._at_wall and self.opening.opening < 0.0
        return self.start.kind in ("incoming", "moving") and arrives

    @property
    def _at_wall(self) -> bool:
        return self.opening.gap == 0.0

    def tell_moving_start(self, masses: NDArray[np.float64], impact_velocity: float) -> None:
        """Look again at a first frame that shows no collision's start, with what is known now."""
        if self.start.kind != "late":
            return
        if self.layout.targets:  # the impact velocity is that of this frame
            self.start = replace(self.start, kind="moving")
            return
        v = self.opening.velocities
        # Printed velocities, each rounded by as much; and the additions of all.
        slack = 4.0 * self.resolution + 1e-9 * impact_velocity
        slack += v.size * float(np.finfo(float).eps * np.max(np.abs(v)))
        kind = find_moving_start(v, masses, impact_velocity, slack, self._at_wall)
        self.start = replace(self.start, kind=kind)

    def states(self) -> Iterator[ChainState]:
        """Yield all states, the first included, in order of time."""
        yield self.opening
        time = self.opening.time
        for frame in self._frames:
            self.last_interval = max(0, frame.step - self.last.step)
            self.last = frame
            state = self.layout.state(frame, self._timestep)
            if state.time < time:
                raise InputError(
                    f"the frame of step {state.step} is earlier than the one before it; expected "
                    "the frames of one run in order of time"
                )
            time = state.time
            yield state

    def impact_velocity(self, given: float | None) -> float:
        """Prefer the given impact speed, which has all its digits, if the first frame agrees."""
        seen = self.start.impact_velocity
        if given is None:
            if seen is None:
                raise InputError(
                    "the first frame is not the start of a collision (all particles at -v0, or "
                    "the first just turned round), so the impact speed is not known; give it "
                    "(--velocity)"
                )
            return seen
        if seen is not None and abs(seen - given) > 4.0 * self.resolution + 1e-9 * given:
            raise InputError(
                f"the dump starts with the impact speed {seen:.9g}, the scene says {given:.9g}; "
                "expected the dump of that scene"
            )
        return given
