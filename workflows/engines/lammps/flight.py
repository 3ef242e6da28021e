"""Move the bodies from contact to contact in LAMMPS."""

import math
from abc import ABC, abstractmethod

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.contact_search import (
    PathPoint,
    count_sign_changes,
    first_root,
    fit_path,
)
from chaincor.workflows.engines.lammps.contact import (
    ContactRecord,
    HardContactEvents,
    SoftContactEvents,
    grading,
    time_to_zero,
)
from chaincor.workflows.engines.lammps.guard import WallGuard
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import LostAtomsError, TimestepError

# Two zeros of a path count as the same contact if they are closer than this fraction of a step.
_RESOLUTION = 1e-3


def first_crossing(start: PathPoint, end: PathPoint, step: float) -> float | None:
    """
    Return the time at which x(t) first reaches zero within a step, or None if it does not.

    x(t) is the quintic through position, velocity and acceleration at both ends. A particle that
    starts at the wall (x = 0) and moves away does not cross it.
    """
    if not math.isfinite(end[0]):
        raise LostAtomsError(f"particle 1 is at {end[0]}. Use a smaller timestep")
    if count_sign_changes(start, end, step) == 0:
        return None
    part = first_root(fit_path(start, end, step), 1.0)
    return None if part < 0.0 else float(part * step)


def foreseen_crossing(start: PathPoint, end: PathPoint, step: float) -> float | None:
    """
    Predict the time in the next step at which particle 1 reaches the wall; None if unclear.

    The prediction extrapolates the quintic of the last step.
    """
    x, v, _ = end
    if v >= 0.0 or x + 2.0 * v * step > 0.0:
        return None
    path = fit_path(start, end, step)
    if sum(c * 2.0**k for k, c in enumerate(path)) > 0.02 * v * step:
        return None  # particle 1 may just miss the wall
    part = first_root(path, 2.0)
    return float((part - 1.0) * step) if part > 1.0 else None


class LammpsFlight(ABC):
    """Motion of a chain from contact to contact."""

    def __init__(self, chain: LammpsChain, contact_events: HardContactEvents) -> None:
        self.chain, self.contact_events = chain, contact_events
        self.time = 0.0  #: Time since the first contact.

    @abstractmethod
    def advance(self, limit: float) -> ContactRecord | None:
        """
        Move to the next contact and apply it.

        Return the contact. Return None if a step ends at or after the time `limit` without a
        contact, or if soft bodies start to touch.
        """


class VerletFlight(LammpsFlight):
    """
    Motion by single Verlet steps, with either wall model.

    The position at the end of each step, x + v h + f h^2/2, is known exactly in advance. A step
    that would end behind the wall contains a contact. With the event wall, this step is shortened
    to end at the wall, and the velocity of particle 1 is reversed there. A step is also shortened
    if x + v t + f t^2/2 passes the wall and turns back within the step. With the stock wall,
    LAMMPS's own fix reflects a particle that ends a step behind the wall.

    While particle 1 is far from the wall, many steps are taken at once, without checks. The
    acceleration of particle 1 may change in this time; therefore a `guard` watches these steps. If
    a step ends so close to the wall that a contact is possible, all these steps are undone and
    checked one by one. Without a guard, all steps are checked.
    """

    def __init__(
        self,
        chain: LammpsChain,
        contact_events: HardContactEvents,
        reflect: bool,
        guard: WallGuard | None,
    ) -> None:
        super().__init__(chain, contact_events)
        self.reflect, self._guard = reflect, guard

    def _dips(self, now: PathPoint) -> bool:
        """Return whether particle 1 passes the wall and turns back within the next step."""
        x, v, a = now
        return v < 0.0 < v + self.chain.timestep * a and v * v > 2.0 * x * a

    def advance(self, limit: float) -> ContactRecord | None:
        """Take steps without checks far from the wall, and check each step near the wall."""
        chain, h = self.chain, self.chain.timestep
        start, taken = self.time, 0
        last = max(1, math.ceil((limit - start) / h))
        while taken < last:
            now = self.contact_events.state()
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
                    f"particle 1 is at {ahead} at time {self.time:g}. Use a smaller timestep"
                )
            chain.run(1)
            taken += 1
            self.time = start + taken * h
        return None

    def _hit(self, now: PathPoint) -> ContactRecord | None:
        """Shorten the step to end at the wall; return None if the last kick turned particle 1."""
        s = time_to_zero(*now)
        if s > 0.0:
            self.chain.verlet(s)
        self.time += s
        return self.contact_events.arrive(self.time)

    def _reflect(self, now: PathPoint) -> ContactRecord:
        chain, h = self.chain, self.chain.timestep
        x, v, a = now
        # LAMMPS's fix reverses the velocity that particle 1 has in the middle of the step.
        speed = -v - 0.5 * h * a
        time = self.time + x / speed
        chain.run(1)
        self.time += h
        return ContactRecord(time, speed, 2.0 * self.contact_events.reduced_mass * speed, time)


class ComposedFlight(LammpsFlight):
    """
    Motion by composed or extrapolated steps, with the event wall.

    A contact is located on the composed map itself: a step is shortened until it ends at the wall.
    If the path of the previous step predicts the contact, the shortened step is taken at once.
    Otherwise it is taken after the full step has ended behind the wall.
    """

    _MOST_CORRECTIONS = 8
    _AT_WALL = 1e-12
    # Both limits are fractions of H. A correction shorter than _SHORT is taken as one Verlet step,
    # whose error, (1e-3 H)^3/12, is less than the error of the composition. After a correction
    # shorter than _EXACT, no further correction is needed, because its error is below rounding.
    _SHORT, _EXACT = 1e-3, 1e-5

    def advance(self, limit: float) -> ContactRecord | None:
        """Take steps, and search for a contact in each step."""
        chain = self.chain
        earlier: PathPoint | None = None
        now, step = self.contact_events.state(), chain.timestep
        while self.time < limit:
            if now[0] == 0.0 and now[1] < 0.0:
                return self.contact_events.arrive(self.time)
            before = chain.snapshot()
            done, step = step, self.contact_events.step(self.time, now)
            if earlier is not None:
                foreseen = foreseen_crossing(earlier, now, done)
                if foreseen is not None:
                    taken = self._go_to_wall(now, foreseen)
                    if taken is not None and taken <= step:
                        self.time += taken
                        return self.contact_events.arrive(self.time)
                    chain.restore(before)
            chain.step(None if step == chain.timestep else step)
            after = self.contact_events.state()
            guess = first_crossing(now, after, step)
            if guess is not None:
                whole = chain.snapshot()
                chain.restore(before)
                taken = self._go_to_wall(now, guess)
                if taken is not None:
                    self.time += taken
                    return self.contact_events.arrive(self.time)
                # The quintic between the ends of the step reaches the wall, but particle 1 itself
                # does not.
                chain.restore(whole)
                if after[0] < 0.0:
                    raise TimestepError(
                        f"particle 1 ends a step behind the wall at time {self.time:g}, but its "
                        "contact is not found within this step. Use a smaller timestep"
                    )
            earlier, now = now, after
            self.time += step
        return None

    def _go_to_wall(self, now: PathPoint, guess: float) -> float | None:
        """Move to the first contact; return the time until the contact, None if there is none."""
        state = self.chain.snapshot()
        taken = self._step_to_wall(guess)
        if taken is not None:
            # If the path reaches the wall before this contact, move to the earlier contact instead.
            first = first_crossing(now, (0.0, *self.contact_events.state()[1:]), taken)
            if first is not None and first < (1.0 - 2.0 * _RESOLUTION) * taken:
                self.chain.restore(state)
                return self._step_to_wall(first)
        return taken

    def _step_to_wall(self, guess: float) -> float | None:
        """Move to the wall; return the time until the contact, or None if none is found."""
        chain = self.chain
        chain.step(guess)
        taken = guess
        for _ in range(self._MOST_CORRECTIONS):
            x, v, _ = self.contact_events.state()
            # This limit is far below the rounding of positions, about 1e-16 of the natural length.
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
        x, v, _ = self.contact_events.state()
        arrived = abs(x) < self._AT_WALL and v < 0.0 < taken
        return taken if arrived else None


def flight_of(
    chain: LammpsChain, problem: Problem, numerics: Numerics, guarded: bool = True
) -> LammpsFlight:
    """Return the flight that moves the bodies of a scene with given numerics."""
    line = problem.line
    contact_events = HardContactEvents(chain, line)
    if line.soft:
        order = STEP_SCHEMES[numerics.scheme].order
        graded = grading(line.contact.onset, problem.fast_stiffness, order)
        contact_events = SoftContactEvents(chain, line, graded)
    if numerics.scheme != "verlet":
        return ComposedFlight(chain, contact_events)
    reflect = numerics.wall == "reflect"
    # The guard supports only a cold chain of unit masses at a hard, rigid wall.
    guarded = guarded and line.is_standard and problem.particles > 1
    guard = WallGuard(chain, problem, reflect) if guarded else None
    return VerletFlight(chain, contact_events, reflect, guard)
