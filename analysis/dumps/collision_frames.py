"""The frames of a collision, from its start on."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from chaincor.analysis.dumps.chain_frames import ChainLayout
from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.start import Start, find_moving_start, find_start
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError

# Digits of the shortest formats of dumps.
_SAME_SPEED = 1e-4


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

    def first_contact(
        self, masses: Sequence[Array], impact_velocity: float
    ) -> tuple[float, ChainState] | None:
        """Return the closing speed of a contact in the first frame, and the state right after."""
        if not self.begins_at_contact:
            return None
        state = self.opening
        speed = abs(state.opening)
        if self.layout.targets:
            return speed, state.after_contact(masses) if state.opening < 0.0 else state
        if not self.start.moving:
            speed = impact_velocity
        return speed, state.turned_round(speed)

    def impact_velocity(self, masses: Sequence[Array], given: float | None) -> float:
        """
        Return how fast the bodies come together, and look again at what the first frame shows.

        A given speed, which has all its digits, is preferred if the first frame agrees: InputError
        if it does not, or nothing tells the speed.
        """
        if self.layout.targets:
            velocity = self._approach(masses, given)
        else:
            velocity = self._speed_at_wall(given)
        self._tell_moving_start(masses[0], velocity)
        return velocity

    def _speed_at_wall(self, given: float | None) -> float:
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

    def _approach(self, masses: Sequence[Array], given: float | None) -> float:
        """Return how fast a chain and a free target come together in the first frame."""
        opening = self.opening
        v0 = -opening.separation(masses)
        if opening.gap == 0.0 and opening.opening > 0.0:
            # The frame may be that right after the first contact, before which they came faster.
            share = sum(1.0 / float(np.sum(m)) for m in masses) / sum(1.0 / m[0] for m in masses)
            before = v0 + 2.0 * float(opening.opening * share)
            known = (
                _is_cold(opening.after_contact(masses), self.resolution)
                if given is None
                else (abs(before / given - 1.0) <= _SAME_SPEED)
            )
            if known:
                self.start = Start("turned", None)
                return before
        if not v0 > 0.0:
            raise InputError(
                f"the bodies move apart with {-v0:.6g} in the first frame; expected a dump that "
                "begins before they meet, with the chain at larger x than the target"
            )
        if given is not None and abs(v0 / given - 1.0) > _SAME_SPEED:
            raise InputError(
                f"the bodies come together with {v0:.9g} in the first frame, in the scene with "
                f"{given:.9g}; expected a dump of that job from before their contact"
            )
        return v0

    def _tell_moving_start(self, masses: Array, impact_velocity: float) -> None:
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


def _is_cold(state: ChainState, resolution: float) -> bool:
    """Return whether all particles of each body fly alike."""
    slack = 8.0 * resolution + 1e-9 * float(np.max(np.abs(state.all_velocities)))
    return all(np.ptp(body.velocities) <= slack for body in state.bodies)
