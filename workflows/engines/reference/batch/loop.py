"""
Build the loop that moves many chains at a hard wall side by side.

Each pass moves the chains in all SIMD lanes (``lanes``), each chain by its own step. If a chain may
reach the wall in a step, it waits outside the lanes until the time of the contact is found. It then
moves up to the contact in a free lane. A search for a contact moves the particles near the wall by
a sequence of steps; the length of each step depends on the steps before. For one chain, these
particles are too few for the vector units of a processor: one search takes as long as several steps
of a whole chain of twenty particles. Searches therefore wait until they fill the lanes, and then
run side by side as well. All decisions are made in the same order as in ``motion``. The result of a
chain in a batch therefore equals the result of a single run, to the last bit.
"""

from collections.abc import Callable

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.contact_search import PathPoint, build_search_steps
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.batch.lanes import (
    FREE,
    LANES,
    MEETS,
    MOVING,
    OPEN,
    PROVED,
    REPEATED,
    ChainRows,
    Lanes,
    LaneState,
    Places,
    Queue,
    build_lane_step,
)
from chaincor.workflows.engines.reference.events import build_contact
from chaincor.workflows.engines.reference.line_traits import KernelSpec
from chaincor.workflows.engines.reference.stages import Parameters, VerletKernels
from chaincor.workflows.engines.schemes import StepCoefficients
from chaincor.workflows.engines.whole_end import EndBounds, is_over

# The end is checked at the larger of two intervals: _FIRST_LOOK times the time that sound takes
# through one bond, and _LATER_LOOKS times the time since the last contact. A check costs less than
# a step.
_FIRST_LOOK, _LATER_LOOKS = 2.0, 0.1


def build_carry(source: KernelSpec, _stages: VerletKernels, split: bool) -> Callable:
    """
    Return the loop over chains, with split or extrapolated steps.

    ``carry(rows, lanes, near, rule, bounds, places, most)`` moves each chain until it has taken its
    number of steps, its end is proved, or the caller must act. The status of the chain states the
    reason. The loop also returns after a total of about `most` steps. `lanes` are `Lanes` for whole
    chains. `near` are `Lanes` for the particles near the wall, used by the search for contacts.
    """
    register, gap_derivatives = source.register, build_contact(source).gap_derivatives
    take_step = register(build_lane_step(source, split), inline=False)
    over = register(is_over, inline=False)
    is_free, begin_search, go_on = build_search_steps(register)
    is_likely, may_be_over = map(register, (bookkeeping.is_likely, bookkeeping.may_be_over))
    record_contact, note_parting = map(
        register, (bookkeeping.record_contact, bookkeeping.note_parting)
    )
    note_impulse, widen, begin_range = map(
        register, (bookkeeping.note_impulse, bookkeeping.widen, bookkeeping.begin_range)
    )

    @register
    def push(queue: Queue, s: int) -> None:
        queue.chains[queue.held[0]] = s
        queue.held[0] += 1

    @register
    def pop(queue: Queue) -> int:
        queue.held[0] -= 1
        return queue.chains[queue.held[0]]

    @register
    def point_of(lane: LaneState, k: int, parameters: Parameters) -> PathPoint:
        strain, velocity, distance = lane
        return gap_derivatives(distance[k], (strain[k:], velocity[k:]), parameters)

    @register
    def load(s: int, k: int, rows: ChainRows, lane: LaneState) -> None:
        # A lane may have room for only the particles near the wall.
        for i in range(lane[0].shape[0] // LANES):
            lane[0][i * LANES + k] = rows.strains[s, i]
        for i in range(lane[1].shape[0] // LANES):
            lane[1][i * LANES + k] = rows.velocities[s, i]
        lane[2][k] = rows.run_states[s].position

    @register
    def note(s: int, k: int, strains: Array, velocities: Array, lane: LaneState) -> None:
        for i in range(strains.shape[1]):
            strains[s, i] = lane[0][i * LANES + k]
        for i in range(velocities.shape[1]):
            velocities[s, i] = lane[1][i * LANES + k]

    @register
    def unload(s: int, k: int, rows: ChainRows, lane: LaneState) -> None:
        note(s, k, rows.strains, rows.velocities, lane)
        rows.run_states[s].position = lane[2][k]

    @register
    def park(k: int, lane: LaneState, steps: Array) -> None:
        # An unused lane contains a chain without motion; it costs as much as any other lane.
        for i in range(lane[0].shape[0] // LANES):
            lane[0][i * LANES + k] = 0.0
        for i in range(lane[1].shape[0] // LANES):
            lane[1][i * LANES + k] = 0.0
        lane[2][k] = 1.0
        steps[k] = 0.0

    @register
    def begin_step(s: int, rows: ChainRows) -> None:
        move, step = rows.moves[s], rows.steps[s]
        move.begun, move.left = rows.run_states[s].steps * step, step

    @register
    def wait_if_likely(s: int, start: PathPoint, rows: ChainRows, places: Places) -> bool:
        # If a contact is likely, search for it before the step, as in ``motion``.
        move = rows.moves[s]
        move.duration, move.known = move.left, OPEN
        likely = is_likely(rows.run_states[s], start, move.left)
        if likely:
            push(places.waiting, s)
        return likely

    @register
    def next_in(
        last: int, more: bool, rows: ChainRows, places: Places, parameters: Parameters
    ) -> tuple[int, int]:
        # Return the chain for the next free lane, or -1, and the last chain that was begun.
        if places.found.held[0] > 0:
            return pop(places.found), last
        while more and last + 1 < rows.statuses.shape[0]:
            last += 1
            if rows.statuses[last] != MOVING:
                continue
            begin_step(last, rows)
            state = rows.strains[last], rows.velocities[last]
            start = gap_derivatives(rows.run_states[last].position, state, parameters)
            if not wait_if_likely(last, start, rows, places):
                return last, last
        return -1, last

    @register
    def search(
        searching: int, near: Lanes, rows: ChainRows, places: Places, rule: StepCoefficients
    ) -> int:
        # For each search, compute one point of the path; return the number of unfinished searches.
        searched, run_states = places.searched, rows.run_states
        kept, moved, room = near
        for k in range(LANES):
            if searched[k] < 0 and places.waiting.held[0] > 0:
                s = searched[k] = pop(places.waiting)
                searching += 1
                load(s, k, rows, kept)
                start = point_of(kept, k, rule.parameters)
                begin_search(run_states[s], rows.moves[s].left, start)
                room.steps[k] = run_states[s].search_time
        take_step(near, 1, rule)
        for k in range(LANES):
            s = searched[k]
            if s < 0:
                continue
            run_state, move = run_states[s], rows.moves[s]
            if not go_on(run_state, point_of(moved, k, rule.parameters)):
                room.steps[k] = run_state.search_time
                continue
            if run_state.search_time >= 0.0:
                move.duration, move.known = run_state.search_time, MEETS
            else:
                move.known = FREE if move.known == OPEN else REPEATED
            push(places.found, s)
            searched[k] = -1
            searching -= 1
        return searching

    @register
    def touch(s: int, k: int, rows: ChainRows, new: LaneState, places: Places) -> None:
        # Reverse the velocity of particle 1 at the wall, as ``motion`` does.
        run_state, contacts, move = rows.run_states[s], rows.contacts[s], rows.moves[s]
        speed = abs(new[1][k])
        new[1][k] = speed
        new[2][k] = 0.0
        move.left -= move.duration
        now = move.begun + (rows.steps[s] - move.left)
        record_contact(run_state, contacts, now, speed)
        begin_range(run_state, places.low[k], places.high[k])
        note_impulse(run_state, contacts, 2.0 * run_state.contact_mass * speed)
        note_parting(run_state, now, places.low[k], places.high[k])
        note(s, k, rows.last_strains, rows.last_velocities, new)

    @register
    def as_it_goes_on(s: int, rows: ChainRows) -> int:
        run_state = rows.run_states[s]
        if run_state.steps >= rows.target_steps[s]:
            return bookkeeping.DONE
        room = rows.contacts.shape[2] - run_state.contacts
        return bookkeeping.FULL if room < bookkeeping.SPARE_CONTACTS else MOVING

    @register
    def look(s: int, rows: ChainRows, bounds: EndBounds) -> int:
        # Check whether the end of the collision is proved; if not, set the time of the next check.
        run_state, state = rows.run_states[s], (rows.strains[s], rows.velocities[s])
        if over(run_state.position, state[0], state[1], rows.energies[s], bounds):
            return PROVED
        away = run_state.steps * rows.steps[s] - run_state.last_contact
        run_state.argue_after = away + max(_FIRST_LOOK * bounds.interval, _LATER_LOOKS * away)
        return as_it_goes_on(s, rows)

    @register
    def after_step(s: int, k: int, rows: ChainRows, places: Places) -> int:
        # Return the status of a chain after a step, as at the end of a step of ``motion``.
        run_state, low, high = rows.run_states[s], places.low[k], places.high[k]
        run_state.steps += 1
        within = run_state.strain_min <= low and high <= run_state.strain_max
        if not within and not widen(run_state, low, high):
            return bookkeeping.OUTSIDE
        if may_be_over(run_state, rows.steps[s]):
            return bookkeeping.ARGUE
        return as_it_goes_on(s, rows)

    @register
    def keeps_lane(
        k: int,
        rows: ChainRows,
        lanes: Lanes,
        rule: StepCoefficients,
        bounds: EndBounds,
        places: Places,
        more: bool,
    ) -> bool:
        # Process the last move in one lane; return whether the chain stays in the lane.
        (old, new, room), s = lanes, places.whose[k]
        run_state, move = rows.run_states[s], rows.moves[s]
        if move.known != REPEATED:
            run_state.evaluations += run_state.step_evaluations
        if move.known == OPEN:
            start, end = point_of(old, k, rule.parameters), point_of(new, k, rule.parameters)
            if not is_free(start, end, move.left):
                move.known = REPEATED
                unload(s, k, rows, old)
                push(places.waiting, s)
                return False
        status = MOVING
        if move.known == MEETS:
            touch(s, k, rows, new, places)
            if run_state.contacts == rows.contacts.shape[2]:
                status = bookkeeping.CROWDED
        else:
            move.left = 0.0
        if status == MOVING and move.left <= 0.0:
            status = after_step(s, k, rows, places)
            if status == bookkeeping.ARGUE and bounds.reaches.shape[0] > 0:
                unload(s, k, rows, new)
                status = look(s, rows, bounds)
            if more:
                begin_step(s, rows)
        if status == MOVING and move.left > 0.0:
            if not wait_if_likely(s, point_of(new, k, rule.parameters), rows, places):
                room.steps[k] = move.left
                return True
        else:
            rows.statuses[s] = status
        unload(s, k, rows, new)
        return False

    @register
    def note_strains(strain: Array, low: Array, high: Array) -> None:
        for k in range(LANES):
            low[k] = strain[k]
            high[k] = strain[k]
        for i in range(1, strain.shape[0] // LANES):
            for k in range(LANES):
                low[k] = min(low[k], strain[i * LANES + k])
                high[k] = max(high[k], strain[i * LANES + k])

    def carry(
        rows: ChainRows,
        lanes: Lanes,
        near: Lanes,
        rule: StepCoefficients,
        bounds: EndBounds,
        places: Places,
        most: int,
    ) -> None:
        whose, room = places.whose, lanes.room
        bonds = rows.strains.shape[1]
        moving = searching = done = 0
        last = -1
        while True:
            # Load chains into the empty lanes; the chains in all other lanes continue from their
            # new state.
            for k in range(LANES):
                if whose[k] >= 0:
                    continue
                more = done < most
                s, last = next_in(last, more, rows, places, rule.parameters)
                whose[k] = s
                if s < 0:
                    park(k, lanes.new, room.steps)
                    continue
                moving += 1
                load(s, k, rows, lanes.new)
                room.steps[k] = rows.moves[s].duration
            wanted = searching + places.waiting.held[0]
            if moving + wanted == 0:
                return
            if wanted >= min(LANES, moving):
                searching = search(searching, near, rows, places, rule)
                continue
            lanes = Lanes(lanes.new, lanes.old, room)
            take_step(lanes, bonds, rule)
            note_strains(lanes.new[0], places.low, places.high)
            done += moving
            for k in range(LANES):
                if whose[k] < 0:
                    continue
                if not keeps_lane(k, rows, lanes, rule, bounds, places, done < most):
                    whose[k] = -1
                    moving -= 1

    return carry
