"""Between two contacts and at them: when the wall is asked for, and how a hit is carried out."""

import math
from abc import ABC, abstractmethod

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.contact_search import (
    PathPoint,
    count_sign_changes,
    first_root,
    fit_path,
)
from chaincor.workflows.engines.lammps.contact import Contact, Meeting, SoftMeeting, time_to_zero
from chaincor.workflows.engines.lammps.guard import WallGuard
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import LostAtomsError, TimestepError

# Crossings nearer to each other than this part of a step need not be told apart.
_RESOLUTION = 1e-3


def first_crossing(start: PathPoint, end: PathPoint, step: float) -> float | None:
    """
    Return when x(t) first reaches zero within a step, or None where it does not.

    x(t) is the quintic through position, velocity and acceleration at both ends. A start at the
    wall (x = 0, moving away) is no crossing.
    """
    if not math.isfinite(end[0]):
        raise LostAtomsError(
            f"particle 1 is at {end[0]}; expected a finite number: use a smaller timestep"
        )
    if count_sign_changes(start, end, step) == 0:
        return None
    part = first_root(fit_path(start, end, step), 1.0)
    return None if part < 0.0 else float(part * step)


def foretold_crossing(start: PathPoint, end: PathPoint, step: float) -> float | None:
    """
    Return when particle 1 will reach the wall in the step after one just done, if it clearly will.

    The quintic of the step done is continued into the next one.
    """
    x, v, _ = end
    if v >= 0.0 or x + 2.0 * v * step > 0.0:
        return None
    path = fit_path(start, end, step)
    if sum(c * 2.0**k for k, c in enumerate(path)) > 0.02 * v * step:
        return None  # it may just not get there
    part = first_root(path, 2.0)
    return float((part - 1.0) * step) if part > 1.0 else None


class Flight(ABC):
    """Carries a chain from contact to contact; it is in flight, or right after one."""

    def __init__(self, chain: LammpsChain, meeting: Meeting) -> None:
        self.chain, self.meeting = chain, meeting
        self.time = 0.0  #: Since the first contact.

    @abstractmethod
    def advance(self, limit: float) -> Contact | None:
        """
        Go on to the next contact and carry it out.

        None where a step ends at or past the time limit first, or soft bodies come to touch.
        """


class VerletFlight(Flight):
    """
    Single Verlet steps, with either wall.

    Before each step its end is known exactly, x + v h + f h^2/2; a step that would end behind the
    wall is a contact. With the event wall that step is cut at the wall and particle 1 reversed
    there, also if x + v t + f t^2/2 comes to the wall and turns within the step; with the
    reflecting wall LAMMPS's own fix mirrors what ends behind it.

    Many steps are taken at once, blind, while particle 1 is some time away from the wall. Its
    acceleration changes meanwhile, so a `guard` watches them: if one ends nearer to the wall than a
    contact can be, all are taken back and asked for one by one. Without it all are.
    """

    def __init__(
        self, chain: LammpsChain, meeting: Meeting, reflect: bool, guard: WallGuard | None
    ) -> None:
        super().__init__(chain, meeting)
        self.reflect, self._guard = reflect, guard

    def _dips(self, now: PathPoint) -> bool:
        """Return whether particle 1 reaches the wall and turns within the next step."""
        x, v, a = now
        return v < 0.0 < v + self.chain.timestep * a and v * v > 2.0 * x * a

    def advance(self, limit: float) -> Contact | None:
        """Run blind while the wall is some time away, and ask before each step where it is near."""
        chain, h = self.chain, self.chain.timestep
        start, taken = self.time, 0
        last = max(1, math.ceil((limit - start) / h))
        while taken < last:
            now = self.meeting.state()
            if self._guard is not None and (steps := self._guard.run_blind(now, last - taken)):
                taken += steps
                self.time = start + taken * h
                continue
            x, v, a = now
            ahead = x + h * (v + 0.5 * h * a)
            if ahead < 0.0 or (not self.reflect and self._dips(now)):
                return self._reflect(now) if self.reflect else self._hit(now)
            if not math.isfinite(ahead):
                raise LostAtomsError(
                    f"particle 1 is at {ahead} at time {self.time:g}; expected a finite number: "
                    "use a smaller timestep"
                )
            chain.run(1)
            taken += 1
            self.time = start + taken * h
        return None

    def _hit(self, now: PathPoint) -> Contact | None:
        """Cut the step at the wall; None where its last kick turned particle 1 already."""
        s = time_to_zero(*now)
        if s > 0.0:
            self.chain.verlet(s)
        self.time += s
        return self.meeting.arrive(self.time)

    def _reflect(self, now: PathPoint) -> Contact:
        chain, h = self.chain, self.chain.timestep
        x, v, a = now
        # The fix reverses the velocity of the drift, that of the half step.
        speed = -v - 0.5 * h * a
        time = self.time + x / speed
        chain.run(1)
        self.time += h
        return Contact(time, speed, 2.0 * self.meeting.reduced_mass * speed, time)


class ComposedFlight(Flight):
    """
    Composed, split or extrapolated steps with the event wall.

    A contact is located on the composed map itself: a step is shortened to end at the wall. Where
    the step before foretells the contact, the shortened step is taken at once; otherwise after the
    full one has been seen to end behind the wall.
    """

    _MOST_CORRECTIONS = 8
    _AT_WALL = 1e-12
    # Parts of H: a correction this short is left to one Verlet step, which errs by (1e-3 H)^3/12,
    # less than the composition does; and one this short is exact to rounding.
    _SHORT, _EXACT = 1e-3, 1e-5

    def advance(self, limit: float) -> Contact | None:
        """Step, and look ahead and back over each step for a contact."""
        chain = self.chain
        earlier: PathPoint | None = None
        now, step = self.meeting.state(), chain.timestep
        while self.time < limit:
            if now[0] == 0.0 and now[1] < 0.0:
                return self.meeting.arrive(self.time)
            before = chain.snapshot()
            done, step = step, self.meeting.step(self.time, now)
            if earlier is not None:
                foretold = foretold_crossing(earlier, now, done)
                if foretold is not None:
                    taken = self._go_to_wall(now, foretold)
                    if taken is not None and taken <= step:
                        self.time += taken
                        return self.meeting.arrive(self.time)
                    chain.restore(before)
            chain.step(None if step == chain.timestep else step)
            after = self.meeting.state()
            guess = first_crossing(now, after, step)
            if guess is not None:
                whole = chain.snapshot()
                chain.restore(before)
                taken = self._go_to_wall(now, guess)
                if taken is not None:
                    self.time += taken
                    return self.meeting.arrive(self.time)
                # The polynomial touched the wall and the motion did not.
                chain.restore(whole)
                if after[0] < 0.0:
                    raise TimestepError(
                        f"particle 1 ends a step behind the wall at time {self.time:g}, but does "
                        "not come in within it; expected a motion that the step resolves: use a "
                        "smaller timestep"
                    )
            earlier, now = now, after
            self.time += step
        return None

    def _go_to_wall(self, now: PathPoint, guess: float) -> float | None:
        """Return the time to the first contact, having gone there; None where none is found."""
        state = self.chain.snapshot()
        taken = self._step_to_wall(guess)
        if taken is not None:
            # The way there must have been in front of the wall.
            first = first_crossing(now, (0.0, *self.meeting.state()[1:]), taken)
            if first is not None and first < (1.0 - 2.0 * _RESOLUTION) * taken:
                self.chain.restore(state)
                return self._step_to_wall(first)
        return taken

    def _step_to_wall(self, guess: float) -> float | None:
        """Return the time to the wall, having gone there; None where no contact is found."""
        chain = self.chain
        chain.step(guess)
        taken = guess
        for _ in range(self._MOST_CORRECTIONS):
            x, v, _ = self.meeting.state()
            # Positions are rounded to about 1e-16 of the natural length.
            if abs(x) < 1e-18 or v == 0.0:
                break
            correction = -x / v
            if abs(correction) > chain.timestep:
                break
            taken += correction
            if abs(correction) >= self._SHORT * chain.timestep:
                chain.step(correction)
                continue
            chain.verlet(correction)
            if abs(correction) < self._EXACT * chain.timestep:
                break
        x, v, _ = self.meeting.state()
        arrived = abs(x) < self._AT_WALL and v < 0.0 < taken
        return taken if arrived else None


def flight_of(chain: LammpsChain, scene: Scene, numerics: Numerics, guarded: bool = True) -> Flight:
    """Return what carries the bodies of a scene in the steps of some numerics."""
    meeting = Meeting(chain, scene.line)
    if scene.line.soft:
        meeting = SoftMeeting(chain, scene, STEP_SCHEMES[numerics.scheme].order)
    if numerics.scheme != "verlet":
        return ComposedFlight(chain, meeting)
    reflect = numerics.wall == "reflect"
    # LAMMPS watches one body at a hard wall.
    guarded = guarded and scene.line.is_standard and scene.particles > 1
    guard = WallGuard(chain, scene, reflect) if guarded else None
    return VerletFlight(chain, meeting, reflect, guard)
