"""The motion of the stepping engine: composed steps, contacts inside them, and what ends a run."""

from collections.abc import Callable

import numpy as np

# Why `advance` came back: all steps done, the end may be near, no room for more contacts, more
# contacts in one step than make sense, a strain that is not allowed.
DONE, ARGUE, FULL, CROWDED, OUTSIDE = range(5)

# Room for the contacts of one step.
SPARE_CONTACTS = 64

# A bond so far ahead of the front is out of reach within one step: over k bonds a disturbance
# falls by about H^(2k)/(2k)!, which is 5e-14 at H = 1.
FRONT_MARGIN = 8
# A strain below this times the impact velocity has not begun to move. What is left out, summed
# over all steps of a run, stays orders of magnitude below rounding.
FRONT_THRESHOLD = 1e-24
# The front takes up as many bonds at once as a vector holds: rests are done one by one.
FRONT_BLOCK = 8
# A contact within a step is likely where the parabola that particle 1 follows at first ends lower
# than this part of the way that the impact velocity would take it.
LIKELY = 0.05

LEDGER = np.dtype(
    [
        ("wall_distance", "f8"),  # x of particle 1
        ("impact_velocity", "f8"),  # v0
        ("momentum", "f8"),  # of the chain, from the impulses
        ("last_contact", "f8"),  # when particle 1 left the wall
        ("argue_after", "f8"),  # the end is argued when so much time has passed since then
        ("patience", "f8"),  # and that is so many mean intervals between contacts
        ("strain_min", "f8"),  # smallest and largest strain met
        ("strain_max", "f8"),
        ("contact_min", "f8"),  # the same up to the last contact
        ("contact_max", "f8"),
        ("strain_floor", "f8"),  # strains outside these stop the run
        ("strain_ceiling", "f8"),
        ("steps", "i8"),  # full steps done
        ("contacts", "i8"),
        ("active", "i8"),  # bonds that have begun to move
        ("evaluations", "i8"),  # of all bond forces
        ("step_evaluations", "i8"),  # of one step
    ]
)


def build_motion(
    force: Callable,
    leap: Callable,
    count_outside: Callable,
    copy: Callable,
    contact_search: Callable,
    register: Callable,
) -> Callable:
    """
    Put the loops of the stepping engine together.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain, ``force(strain, parameters)``.
    leap : callable
        One step away from the wall, as in ``schemes``.
    count_outside, copy : callable
        As in ``stages``.
    contact_search : callable
        ``reference_contact.build_contact_search``.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    callable
        ``advance(ledger, now, contacts, last, kept, near, trial, goal, step, scheme,
        parameters)``: take steps until `goal` of them are done or something needs the caller.

        Arrays are changed in place. `contacts` (2, capacity) holds times and incoming speeds; the
        others are (strain, velocity) pairs: of `now`, right after the `last` contact, `kept` from
        before a step, `near` the wall while a contact is searched, and scratch for a `trial`.
        `scheme` is that of `leap`.
    """

    @register
    def probe(time, wall_distance, kept, work, scheme, parameters):
        # Particle 1 after a step of any size; of the bonds only the first matters.
        near, trial, bonds = work
        x = leap(wall_distance, kept, near, trial, bonds, 1, time, scheme, parameters)
        return x, near[1][0], -force(near[0][0], parameters)

    find_contact = contact_search(probe=probe, register=register)

    @register
    def carry(ledger, now, contacts, last, kept, near, trial, begin, step, scheme, parameters):
        # On return the step is done, contacts within it included; the grid of steps is kept,
        # which keeps the motion reversible in time.
        bonds = ledger.active
        strain, velocity = now
        work = (near, trial, bonds)
        left = step
        while left > 0.0 and ledger.contacts < contacts.shape[1]:
            copy(strain, velocity, kept[0], kept[1], bonds)
            x0 = ledger.wall_distance
            start = (x0, velocity[0], -force(strain[0], parameters))
            # Where a contact is likely, the few particles that act on particle 1 are moved first:
            # it costs less than to move the chain and to take that back.
            ahead = x0 + left * (start[1] + 0.5 * left * start[2])
            likely = ahead < LIKELY * left * ledger.impact_velocity
            if likely:
                end = probe(left, x0, kept, work, scheme, parameters)
            else:
                x1 = leap(x0, kept, now, trial, bonds, bonds, left, scheme, parameters)
                ledger.evaluations += ledger.step_evaluations
                end = (x1, velocity[0], -force(strain[0], parameters))
            time = find_contact(left, start, end, kept, work, scheme, parameters)
            if likely or time >= 0.0:
                moved = time if time >= 0.0 else left
                x1 = leap(x0, kept, now, trial, bonds, bonds, moved, scheme, parameters)
                ledger.evaluations += ledger.step_evaluations
            if time < 0.0:
                ledger.wall_distance = x1
                return 0.0
            speed = abs(velocity[0])
            velocity[0] = speed
            left -= time
            ledger.wall_distance = 0.0
            ledger.momentum += 2.0 * speed
            ledger.last_contact = begin + (step - left)
            ledger.argue_after = ledger.patience * ledger.last_contact / ledger.contacts
            copy(strain, velocity, last[0], last[1], bonds)
            ledger.contact_min = min(ledger.strain_min, np.min(strain[:bonds]))
            ledger.contact_max = max(ledger.strain_max, np.max(strain[:bonds]))
            contacts[0, ledger.contacts] = ledger.last_contact
            contacts[1, ledger.contacts] = speed
            ledger.contacts += 1
        return left

    def advance(ledger, now, contacts, last, kept, near, trial, goal, step, scheme, parameters):
        strain = now[0]
        bonds = strain.shape[0]
        threshold = FRONT_THRESHOLD * ledger.impact_velocity
        while ledger.steps < goal:
            if contacts.shape[1] - ledger.contacts < SPARE_CONTACTS:
                return FULL
            begin = ledger.steps * step
            left = carry(
                ledger, now, contacts, last, kept, near, trial, begin, step, scheme, parameters
            )
            if left > 0.0:
                return CROWDED
            ledger.steps += 1
            active = ledger.active
            if count_outside(strain, active, ledger.strain_min, ledger.strain_max) > 0:
                low, high = np.min(strain[:active]), np.max(strain[:active])
                ledger.strain_min = min(ledger.strain_min, low)
                ledger.strain_max = max(ledger.strain_max, high)
                if not (low > ledger.strain_floor and high < ledger.strain_ceiling):
                    return OUTSIDE
            while active < bonds and abs(strain[active - FRONT_MARGIN]) > threshold:
                active = min(bonds, active + FRONT_BLOCK)
            ledger.active = active
            away = ledger.steps * step - ledger.last_contact
            if ledger.momentum > 0.0 and away >= ledger.argue_after:
                return ARGUE
        return DONE

    return advance
