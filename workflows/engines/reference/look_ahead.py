"""Search ahead of the exact run for the end of a collision or the next contact."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.end_watch import EndWatch
from chaincor.workflows.engines.ending import (
    RISK_AT_STAKE,
    Ending,
    evaporation,
    sound_round_trip,
)
from chaincor.workflows.engines.fragments import Body
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.blocks.running import LEAST_ACTIVE
from chaincor.workflows.engines.reference.coarse_run import (
    CoarseRun,
    coarse_ceiling,
    coarse_step,
    find_end,
    highest_frequency,
    longest_strain,
    required_clearance,
)
from chaincor.workflows.engines.reference.finish import End, strain_error, unfinished_error
from chaincor.workflows.engines.reference.moving import Motion, Stepper
from chaincor.workflows.errors import RunError

# Length of the steps of order 8 in `follow`, in units of 1/frequency of the stiffest bond. The
# motion is then accurate to some parts in 1e7.
STEP = 0.3

# The motion of a chain that broke is repeated at several steps: the step of the run times each
# factor in _SAMPLES, and in _MORE_SAMPLES if the first motions end differently. The cost grows with
# the square of the number of particles. A chain longer than _MOST_SAMPLED is therefore repeated
# only once, from its last contact on. Repeated from the start, the motion of such a chain would
# already differ in earlier contacts.
_SAMPLES = (0.97, 0.91, 0.83, 0.77)
_MORE_SAMPLES = (0.95, 0.88, 0.8, 0.74)
_MOST_SAMPLED = 400
# `_follow_on` continues the run for at most this many sound round trips. Fragments separate in this
# time. During the last round trip, a return to the wall must be unlikely.
_CALM = 3.0
# If some of the repeated motions have a late contact, the impulse of this contact in the true
# motion may be larger by this factor. The factor and the number of motions are choices;
# `tests.judge.plain` counts how often the error bars contain the true value.
_HARDER = 1.5
# Motions agree if the speeds of their first fragments differ by at most this fraction of v0, and
# the energies of these fragments by at most this fraction of the largest energy.
_ALIKE = 0.01


class LookAhead:
    """
    Search, ahead of an exact run, for evidence that no further contact comes.

    The motion of a hot chain that broke loses the memory of its initial state within some hundred
    units of time. Several motions are then run from the start, with errors as large as the errors
    of the run. If only some of these motions have a late contact, or can still have a late contact,
    such errors decide about late contacts, and the end is in doubt.

    `moving` stays unchanged except for its count of force evaluations. Coarse steps are taken only
    if they are cheaper than the steps of the run. `first` returns the bodies at step zero; by
    default, this is the initial state of the scene. `start` is the time between the first contact
    and step zero, if step zero comes later.
    """

    def __init__(
        self,
        problem: Problem,
        moving: Motion,
        first: Callable[[], Motion] | None = None,
        start: float = 0.0,
    ) -> None:
        self._problem, self._moving, self._start = problem, moving, start
        self._bond, self._stepper = problem.bond, moving.stepper
        self._first = first or partial(Motion.at_start, problem, moving.stepper)
        self._long = problem.longest_body > _MOST_SAMPLED
        self._quiet = sound_round_trip(problem.longest_body, problem.slow_stiffness)
        self._not_before = 0.0
        # Largest impulse among contacts that occur, or may occur, only in some of the repeated
        # motions.
        self.doubt = 0.0
        # If repeated motions have a further contact, _awaited contains the number of contacts of
        # the run so far, and the impulse of the further contact.
        self._awaited = (0, 0.0)

    def times(self) -> tuple[float, float]:
        """Return the time, and the end of the last contact (0 if none), since the first contact."""
        run_state = self._moving.run_state
        begun = self._start - float(run_state["first_contact"])
        now = begun + float(run_state["steps"] * self._stepper.step)
        return now, max(begun + float(run_state["last_contact"]), 0.0)

    def _coarse_step(self) -> float:
        shortest = float(self._moving.run_state["strain_min"])
        return coarse_step(self._bond, shortest, self._problem.line.lightest)

    def unresolved(self) -> RunError:
        """Return the error for invalid strains of the bodies."""
        run_state, step = self._moving.run_state, self._stepper.step
        low, high = float(run_state["strain_min"]), float(run_state["strain_max"])
        remedy = f"take a smaller timestep than {step:g}, or a lower speed"
        return strain_error(self._problem, low, high, self.times()[0], remedy)

    def look(self, watch: EndWatch, follow: bool = True) -> End | None:
        """
        Return the end of the collision, or None if another contact may come.

        If `follow` is False, an end that is not proved counts as argued after one sound round trip
        without a contact.
        """
        (now, last), moving = self.times(), self._moving
        bodies = moving.bodies()
        if not all(body.has_finite_energy() for body in bodies):
            raise self.unresolved()  # the step is too long, and the motion grew without bound
        ending = watch.look_at(now, last, bodies)
        if ending is not None:
            return End(self._doubt_about(ending), now, int(moving.run_state["evaluations"]))
        if not follow and now - last > self._quiet:
            return End(Ending("argued"), now, int(moving.run_state["evaluations"]))
        settled = self.settle(watch.early_risk)
        if settled is None:
            return None
        ahead, ending = settled
        evaluations = int(ahead.moving.run_state["evaluations"])
        return End(self._doubt_about(ending), ahead.time, evaluations)

    def _doubt_about(self, ending: Ending) -> Ending:
        """Return the end of the run; it is open if other motions have late contacts."""
        contacts, momentum = self._awaited
        missed = contacts == self._moving.run_state["contacts"]
        return ending.doubted(max(self.doubt, momentum if missed else 0.0))

    def settle(self, early_risk: float = 1.0) -> tuple[CoarseRun, Ending] | None:
        """
        Look ahead from the current state.

        Return the look-ahead run and the end of the collision; None if another contact may come or
        a bond may break. `early_risk` is the risk of a return, estimated soon after the last
        contact, see `EndWatch`.
        """
        run_state, problem = self._moving.run_state, self._problem
        now, last = self.times()
        if now < self._not_before:
            return None
        # After a sound round trip, coarse steps suffice, because the end of a broken chain hardly
        # depends on the accuracy of the steps.
        if now - last > self._quiet:
            # For a long chain, coarse steps save no time, because they use only one core; exact
            # steps use all cores.
            if problem.longest_body > LEAST_ACTIVE:
                return None
            single = self._follow_on(now, last) if early_risk <= RISK_AT_STAKE else None
            return single or self._sample(now, last)
        clearance = required_clearance(problem, self._moving.gap)
        ceiling = coarse_ceiling(problem.bond)
        coarse = self._coarse_step()
        if clearance is None or longest_strain(self._moving) >= ceiling:
            return None
        if 1.0 / coarse >= self._stepper.scheme.evaluations / self._stepper.step:
            return None
        ahead = CoarseRun(self._moving, now, coarse, clearance, ceiling)
        ending = find_end(problem, ahead, last)
        if ending is not None:
            return ahead, ending
        run_state["evaluations"] = ahead.moving.run_state["evaluations"]
        self._not_before = ahead.time
        return None

    def stays_clear(self, until: float) -> tuple[bool, float, int]:
        """
        Return whether the chain never touches the wall again.

        The result consists of a flag, the time up to which the motion was followed, and the number
        of force evaluations so far. After the time `until`, computed by ``whole_end``, energy alone
        excludes a contact.
        """
        run_state, problem = self._moving.run_state, self._problem
        now, _ = self.times()
        evaluations = int(run_state["evaluations"])
        if until <= now:
            return True, now, evaluations
        clearance = required_clearance(problem, self._moving.gap)
        if clearance is None:
            return False, now, evaluations
        coarse, ceiling = self._coarse_step(), coarse_ceiling(problem.bond)
        ahead = CoarseRun(self._moving, now, coarse, clearance, ceiling)
        return ahead.fly(until - now), ahead.time, int(ahead.moving.run_state["evaluations"])

    def _follow_on(self, now: float, last: float) -> tuple[CoarseRun, Ending] | None:
        """
        Continue the motion of the run until a return has been unlikely for a sound round trip.

        A few motions cannot measure a probability below `RISK_AT_STAKE`. One motion therefore
        suffices if the risk was at most `RISK_AT_STAKE` while all motions still agreed. Return None
        if other motions are needed: if a contact comes, or if the risk stays higher. Return None
        also if the end is proved, because a short chain that broke may end differently in other
        motions.
        """
        latest = now + _CALM * self._quiet
        ahead = CoarseRun(self._moving, now, self._coarse_step(), clearance=0.0)
        ending = find_end(self._problem, ahead, last, RISK_AT_STAKE, latest)
        return None if ending is None or ending.kind == "proved" else (ahead, ending)

    def _sample(self, now: float, last: float) -> tuple[CoarseRun, Ending] | None:
        """Follow several motions to their ends."""
        shares = _SAMPLES[:1] if self._long else _SAMPLES
        ends = [self._follow_again(share, now, last) for share in shares]
        settled = [end for end in ends if isinstance(end, tuple)]
        differ = len(settled) == len(ends) and (
            self._long or not self._alike([end for end, _ in settled])
        )
        if differ and not self._long:
            ends += [self._follow_again(share, now, last) for share in _MORE_SAMPLES]
            settled = [end for end in ends if isinstance(end, tuple)]
        met = [_HARDER * end for end in ends if not isinstance(end, tuple)]
        if settled and (met or differ):
            # If the motions disagree, the run itself is only one of many possible motions.
            self._doubt(met + [ending.momentum_at_stake for _, ending in settled])
        if met:
            self._awaited = int(self._moving.run_state["contacts"]), max(met)
            self._not_before = math.inf
            return None
        return settled[0]

    def _doubt(self, momenta: list[float]) -> None:
        """
        Update the doubt with the impulses of contacts that occur only in some motions.

        Chance decides which motions have such a contact, and how large its impulse is. The doubt
        therefore also includes the largest impulse that is possible from the present state, before
        the motions separate.
        """
        if max(momenta) > 0.0:
            parted = [body.pieces(self._bond) for body in self._moving.bodies()]
            at_stake = sum(evaporation(pieces, self._bond) for pieces in parted)
            self.doubt = max(self.doubt, at_stake, *momenta)

    def _alike(self, runs: list[CoarseRun]) -> bool:
        """Return whether the first fragments of all motions agree."""
        bond, v0 = self._problem.bond, self._problem.impact_velocity

        def agree(bodies: tuple[Body, ...]) -> bool:
            ends = [body.pieces(bond) for body in bodies]
            sizes = {int(pieces.sizes[0]) for pieces in ends}
            speeds = [float(pieces.speeds[0]) for pieces in ends]
            energies = [float(pieces.energies[0]) for pieces in ends]
            return (
                len(sizes) == 1
                and max(speeds) - min(speeds) <= _ALIKE * v0
                and max(energies) - min(energies) <= _ALIKE * max(energies)
            )

        return all(map(agree, zip(*(ahead.moving.bodies() for ahead in runs), strict=True)))

    def _follow_again(
        self, share: float, now: float, last: float
    ) -> tuple[CoarseRun, Ending] | float:
        """Return the end of one more motion, or the impulse of its next contact if one comes."""
        whole = self._moving
        since = whole.run_state["steps"] * self._stepper.step
        if self._long and whole.run_state["last_contact"] > 0.0:
            moving, contacts, since = whole.after_last_contact(), 1, now - last
        else:
            moving = self._first().copy(room=whole.arrays.contacts.shape[1])
            contacts = int(whole.run_state["contacts"])
        moving.stepper = stepper = self._stepper.of_size(share * self._stepper.step)
        bookkeeping.never_argue(moving.run_state)
        moving.advance(math.ceil(since / stepper.step))
        if moving.run_state["contacts"] != contacts:
            return 2.0 * self._problem.line.contact_mass * float(moving.contact_speeds[-1])
        ahead = CoarseRun(moving, now, share * self._coarse_step(), clearance=0.0)
        ending = find_end(self._problem, ahead, last)
        if ending is None:
            return 2.0 * self._problem.line.contact_mass * abs(ahead.moving.closing)
        return ahead, ending


@dataclass(frozen=True)
class Flight:
    """Next event of bodies that are not in contact."""

    #: Time since the first contact, at which the next contact comes or the end was found.
    time: float
    ending: Ending | None  #: End of the collision; None if a contact comes.
    #: Largest impulse of contacts that occur only in some of several nearly equal motions.
    doubt: float = 0.0


def follow(
    problem: Problem,
    strains: Array,
    velocities: Array,
    *,
    now: float,
    last_contact: float,
    shortest: float,
) -> Flight:
    """
    Follow bodies after a contact to their next contact, or to the end of their collision.

    `strains`, including the gap, and `velocities` are along x at the time `now`. The last contact
    ended at `last_contact`; both times count from the first contact. The bodies have at least one
    bond. The length of the step is chosen for the shortest bond so far, of length `shortest`.
    Raises RunError as the stepping engine does.
    """
    line, bond = problem.line, problem.bond
    step = STEP / highest_frequency(bond, shortest - 1.0, line.lightest)
    stepper = Stepper.of(line, bond, "order8", step)
    strains = strains.copy()
    strains[line.gap] = max(float(strains[line.gap]), 0.0)
    moving = Motion.in_state(stepper, strains, velocities, problem.impact_velocity)
    run_state = moving.run_state
    bookkeeping.never_argue(run_state)
    run_state["last_contact"] = last_contact - now
    run_state["strain_min"] = shortest - 1.0
    look_ahead = LookAhead(problem, moving, moving.copy().copy, start=now)
    watch = EndWatch(problem.longest_body, bond, problem.slow_stiffness)
    while True:
        end = look_ahead.look(watch)
        if end is not None:
            return Flight(end.time, end.ending)
        time, _ = look_ahead.times()
        if time > watch.followed_until(last_contact):
            raise unfinished_error(problem, time)
        # Take at least one step, because right after a contact the time until the next check is
        # zero.
        until = max(watch.next_look(time, last_contact), time + step) - now
        status = moving.advance(math.ceil(until / step))
        if run_state["contacts"] > 0:
            return Flight(now + float(moving.contact_times[0]), None, look_ahead.doubt)
        if status != bookkeeping.DONE:
            raise look_ahead.unresolved()
