"""The motion of the stepping engine: composed steps, contacts inside them, and what ends a run."""

from collections.abc import Callable

import numpy as np

# Why `advance` came back: all steps done, the end may be near, no room for more contacts, more
# contacts in one step than make sense, a strain that is not allowed.
DONE, ARGUE, FULL, CROWDED, OUTSIDE = range(5)

# Room for the contacts of one step.
SPARE_CONTACTS = 64

# A bond so far ahead of the front is out of reach within one step: over k bonds a disturbance
# falls by about H^(2k)/(2k)!, which is 4e-36 at H = 1.
FRONT_MARGIN = 16
# A strain below this times the impact velocity has not begun to move. What is left out, summed
# over all steps of a run, stays orders of magnitude below rounding.
FRONT_THRESHOLD = 1e-24

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
    contact_search: Callable,
    register: Callable,
) -> Callable:
    """
    Put the loops of the stepping engine together.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain, ``force(strain, p, q)``.
    leap : callable
        One step away from the wall, as in ``reference_steps``.
    count_outside : callable
        As in ``reference_stages``.
    contact_search : callable
        ``reference_contact.build_contact_search``.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    callable
        ``advance(ledger, strain, velocity, contacts, last, kept, near, goal, step, scheme,
        parameters)``: take steps until `goal` of them are done or something needs the caller.

        Arrays are changed in place. `contacts` (2, capacity) holds times and incoming speeds;
        `last` and `kept` are (strain, velocity) pairs for the state right after the last contact
        and the one before a step, `near` is one for the search. `scheme` is that of
        `leap`.
    """

    @register
    def probe(time, wall_distance, kept, near, scheme, parameters):
        # Particle 1 after a step of any size. Each stage reaches one bond further.
        reach = near[0].shape[0]
        near[0][:] = kept[0][:reach]
        near[1][:] = kept[1][: reach + 1]
        x = leap(wall_distance, near[0], near[1], time, scheme, parameters)
        return x, near[1][0], -force(near[0][0], parameters[0], parameters[1])

    find_contact = contact_search(probe=probe, register=register)

    @register
    def carry(
        ledger, strain, velocity, contacts, last, kept, near, begin, step, scheme, parameters
    ):
        # On return the step is done, contacts within it included; the grid of steps is kept,
        # which keeps the motion reversible in time.
        p, q = parameters
        left = step
        while left > 0.0 and ledger.contacts < contacts.shape[1]:
            kept[0][:] = strain
            kept[1][:] = velocity
            x0 = ledger.wall_distance
            start = (x0, velocity[0], -force(strain[0], p, q))
            x1 = leap(x0, strain, velocity, left, scheme, parameters)
            ledger.evaluations += ledger.step_evaluations
            end = (x1, velocity[0], -force(strain[0], p, q))
            time = find_contact(left, start, end, kept, near, scheme, parameters)
            if time < 0.0:
                ledger.wall_distance = x1
                return 0.0
            strain[:] = kept[0]
            velocity[:] = kept[1]
            leap(x0, strain, velocity, time, scheme, parameters)
            ledger.evaluations += ledger.step_evaluations
            speed = abs(velocity[0])
            velocity[0] = speed
            left -= time
            ledger.wall_distance = 0.0
            ledger.momentum += 2.0 * speed
            ledger.last_contact = begin + (step - left)
            ledger.argue_after = ledger.patience * ledger.last_contact / ledger.contacts
            last[0][: strain.shape[0]] = strain
            last[1][: velocity.shape[0]] = velocity
            contacts[0, ledger.contacts] = ledger.last_contact
            contacts[1, ledger.contacts] = speed
            ledger.contacts += 1
        return left

    def advance(
        ledger, strain, velocity, contacts, last, kept, near, goal, step, scheme, parameters
    ):
        bonds = strain.shape[0]
        threshold = FRONT_THRESHOLD * ledger.impact_velocity
        while ledger.steps < goal:
            active = ledger.active
            moving, moving_velocity = strain[:active], velocity[: active + 1]
            moving_kept = (kept[0][:active], kept[1][: active + 1])
            while ledger.steps < goal and ledger.active == active:
                if contacts.shape[1] - ledger.contacts < SPARE_CONTACTS:
                    return FULL
                left = carry(
                    ledger,
                    moving,
                    moving_velocity,
                    contacts,
                    last,
                    moving_kept,
                    near,
                    ledger.steps * step,
                    step,
                    scheme,
                    parameters,
                )
                if left > 0.0:
                    return CROWDED
                ledger.steps += 1
                if count_outside(moving, ledger.strain_min, ledger.strain_max) > 0:
                    low, high = np.min(moving), np.max(moving)
                    ledger.strain_min = min(ledger.strain_min, low)
                    ledger.strain_max = max(ledger.strain_max, high)
                    if not (low > ledger.strain_floor and high < ledger.strain_ceiling):
                        return OUTSIDE
                while ledger.active < bonds and (
                    ledger.active <= FRONT_MARGIN
                    or abs(strain[ledger.active - FRONT_MARGIN]) > threshold
                ):
                    ledger.active += 1
                away = ledger.steps * step - ledger.last_contact
                if ledger.momentum > 0.0 and away >= ledger.argue_after:
                    return ARGUE
        return DONE

    return advance
