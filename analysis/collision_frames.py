"""Read the frames of a collision, and find its start with data from outside the dump."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from chaincor.analysis.dumps.chain_frames import ChainLayout
from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.dumps.masses import masses_of_bodies
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError

# State in the first frame. ``incoming``: every particle still has the velocity -v0; ``reflected``:
# particle 1 has just been reflected; ``moving`` and ``turned``: the same two states of a chain with
# internal motion, found from the momentum of the chain; ``late``: the collision has already begun.
Start = Literal["incoming", "reflected", "moving", "turned", "late"]
# A dump may have few digits. A speed in the dump therefore agrees with a given speed if the two
# differ by at most this fraction.
_SAME_SPEED = 1e-4
EndArgument = Callable[[float, Array, Array, float, Potential], str | None]


@dataclass(frozen=True, eq=False)
class Known:
    """Data of a collision from outside its dump, in the chain's units; None if unknown."""

    #: Potential of the bonds. If it is known, the analysis computes energies, and finds contacts
    #: however far the frames are apart.
    bond: Potential | None = None
    #: Impact speed v0; by default the speed in the first frame.
    impact_velocity: float | None = None
    timestep: float | None = None  #: Simulated time per step, for dumps that do not carry the time.
    #: Masses of the chain and of a free target, each from the contact outward. By default they come
    #: from the dump, and are 1 if the dump has no masses.
    masses: Sequence[Array] | None = None
    targets: int = 0  #: Particles of a free target; 0 for a wall.
    soft: bool = False  #: Whether the bodies overlap in a contact.
    #: ``f(u_1, strains, velocities, time_since_contact, bond)`` returns the reason why no contact
    #: can follow, or None. The function is called only if all masses are equal. Without the
    #: function, only the time since the last contact is used.
    end_argument: EndArgument | None = None

    def __post_init__(self) -> None:
        """Refuse a velocity or a time step that is not positive."""
        for name, given in (("velocity", self.impact_velocity), ("timestep", self.timestep)):
            if given is not None and not 0.0 < given < np.inf:
                raise InputError(f"the {name} is {given}. Give a positive finite number")


NOTHING_KNOWN = Known()


class CollisionFrames:
    """
    Frames of a collision in order of time, with the initial state read from the first frame.

    Raises InputError if time, masses or speed are unknown, or if known data contradict the first
    frame.
    """

    def __init__(self, frames: Iterator[DumpFrame], known: Known):
        self.known = known
        self._frames = frames
        #: First frame, and the last frame read so far.
        self.first = self.last = next(frames)
        self.last_interval = 0  #: Steps between the last two frames.
        self.layout = ChainLayout.from_frame(self.first, known.targets)
        if self.layout.time_known and known.timestep is not None:
            raise InputError(
                f"the dump contains the time, and a timestep of {known.timestep:g} is given. "
                "Drop the timestep (--timestep)"
            )
        if not self.layout.time_known and known.timestep is None:
            raise InputError(
                "the dump has steps but no times. Give the timestep of the run (--timestep), or "
                "dump the time as a column v_time"
            )
        self.first_state = self.layout.state(
            self.first, known.timestep
        )  #: State in the first frame.
        resolution = self.first.resolution("vx", self.first.significant_digits())
        #: Largest rounding error of a velocity that is printed in the first frame.
        self.resolution = float(np.max(resolution))
        #: Masses of the chain and of a free target, each from the contact outward.
        self.masses = known.masses or masses_of_bodies(self.first, self.layout)[0]
        # Velocities are measured relative to the target, whose particles have equal velocities if
        # the target is cold.
        target = self.first_state.target_velocities
        relative = self.first_state.velocities - (float(target[0]) if target.size else 0.0)
        self.start, seen = find_start(relative, resolution)
        #: Impact speed v0. If the user gives it, the given speed is used, because the speed in the
        #: frame may have fewer digits.
        self.velocity: float
        if target.size:
            if self.start != "incoming" or np.any(target != target[0]):
                self.start = "late"
            self.velocity = self._approach(known.impact_velocity)
        else:
            self.velocity = self._speed_at_wall(seen, known.impact_velocity)
        if self.start == "late":
            self.start = self._moving_start()

    @property
    def digits(self) -> int:
        """Significant digits of the dump. The first frame alone may have round numbers."""
        return max(self.first.significant_digits(), self.last.significant_digits())

    def states(self) -> Iterator[ChainState]:
        """Yield all states in order of time, beginning with the first frame."""
        yield self.first_state
        before = self.first_state
        for frame in self._frames:
            self.last_interval = max(0, frame.step - self.last.step)
            self.last = frame
            state = self.layout.state(frame, self.known.timestep)
            if state.time < before.time:
                raise InputError(
                    f"the frame of step {state.step} is earlier than the one before it. Give the "
                    "frames of one run in order of time"
                )
            if (state.step, state.time) == (before.step, before.time) and not np.array_equal(
                state.displacements, before.displacements
            ):
                raise InputError(
                    f"two frames of step {state.step} have different positions. Give the frames "
                    "of one run, each with its own step"
                )
            before = state
            yield state

    def first_contact(self) -> tuple[float, ChainState] | None:
        """Return the closing speed of a contact in the first frame, and the state after it."""
        state = self.first_state
        arrives = state.gap == 0.0 and state.gap_velocity < 0.0
        turned = self.start in ("reflected", "turned")
        if not turned and not (arrives and self.start in ("incoming", "moving")):
            return None
        speed = abs(state.gap_velocity)
        if self.layout.targets:
            return speed, state.after_contact(self.masses) if state.gap_velocity < 0.0 else state
        if self.start in ("incoming", "reflected"):
            speed = self.velocity
        return speed, state.turned_round(speed)

    def _speed_at_wall(self, seen: float | None, given: float | None) -> float:
        if given is None:
            if seen is None:
                raise InputError(
                    "the impact speed is unknown, because not all particles have the velocity "
                    "-v0 in the first frame, and particle 1 has not just been reflected. Give "
                    "the speed (--velocity)"
                )
            return seen
        if seen is not None and abs(seen - given) > 4.0 * self.resolution + 1e-9 * given:
            raise InputError(
                f"the dump starts with the impact speed {seen:.9g}, but the scene has "
                f"{given:.9g}. Give the dump of this scene"
            )
        return given

    def _approach(self, given: float | None) -> float:
        """Return the closing speed of a chain and a free target in the first frame."""
        first_state, masses = self.first_state, self.masses
        v0 = -first_state.separation(masses)
        if first_state.gap == 0.0 and first_state.gap_velocity > 0.0:
            # The frame may directly follow the first contact. Before that contact the chain was
            # faster.
            share = sum(1.0 / float(np.sum(m)) for m in masses) / sum(1.0 / m[0] for m in masses)
            before = v0 + 2.0 * float(first_state.gap_velocity * share)
            if given is None:
                cold = first_state.after_contact(masses)
                slack = 8.0 * self.resolution + 1e-9 * float(np.max(np.abs(cold.all_velocities)))
                follows = all(np.ptp(body.velocities) <= slack for body in cold.bodies)
            else:
                follows = abs(before / given - 1.0) <= _SAME_SPEED
            if follows:
                self.start = "turned"
                return before
        if not v0 > 0.0:
            raise InputError(
                f"the bodies move apart with {-v0:.6g} in the first frame. Give a dump that "
                "begins before the bodies meet, with the chain at larger x than the target"
            )
        if given is not None and abs(v0 / given - 1.0) > _SAME_SPEED:
            raise InputError(
                f"the bodies approach each other with {v0:.9g} in the first frame, but with "
                f"{given:.9g} in the scene. Give a dump of this job that begins before the "
                "contact"
            )
        return v0

    def _moving_start(self) -> Start:
        """Decide from the momentum whether the first frame shows the start of the collision."""
        if self.layout.targets:  # the impact velocity was taken from this frame
            return "moving"
        v = self.first_state.velocities
        # Bound on the rounding errors of the printed velocities and of their sum.
        slack = 4.0 * self.resolution + 1e-9 * self.velocity
        slack += v.size * float(np.finfo(float).eps * np.max(np.abs(v)))
        at_wall = self.first_state.gap == 0.0
        return find_moving_start(v, self.masses[0], self.velocity, slack, at_wall)


def find_start(velocities: Array, resolution: Array) -> tuple[Start, float | None]:
    """
    Find from the velocities whether the collision has begun; return this state and the speed.

    The first velocity is that of particle 1. `resolution` is half a unit of the last printed digit.
    The impact speed is None if the velocities alone do not show it.
    """
    outer = velocities[1:] if velocities.size > 1 else -np.abs(velocities)
    speed = -float(outer[-1])
    # In free flight, rounded positions cause small forces, which hardly change the velocities.
    slack = max(4.0 * float(np.max(resolution)), 1e-9 * speed)
    if not speed > 0.0 or np.any(np.abs(outer + speed) > slack):
        return "late", None
    if abs(velocities[0] + speed) <= slack:
        return "incoming", speed
    if abs(velocities[0] - speed) <= slack:
        return "reflected", speed
    return "late", None


def find_moving_start(
    velocities: Array, masses: Array, impact_velocity: float, slack: float, at_wall: bool
) -> Start:
    """
    Decide from the momentum whether a chain with internal motion has already hit the wall.

    Before the contact, the velocity of the centre of mass differs from -v0 by at most `slack`.
    `at_wall` says whether particle 1 is at the wall, where its velocity may just have been
    reversed.
    """
    total = float(np.sum(masses))
    mean = float(masses @ velocities) / total
    if abs(mean + impact_velocity) <= slack:
        return "moving"
    before = mean - 2.0 * float(masses[0] * velocities[0]) / total
    return "turned" if at_wall and abs(before + impact_velocity) <= slack else "late"
