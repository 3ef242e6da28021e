"""Define the scalar state of a run, and update it at the ends of contacts and steps."""

import math
from typing import Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.contact_search import SEARCH_FIELDS

# A loop returns for one of these reasons: all steps are done (DONE), the collision may be over
# (ARGUE), there is no room for more contacts (FULL), one step has too many contacts (CROWDED), or a
# strain is not allowed (OUTSIDE).
DONE, ARGUE, FULL, CROWDED, OUTSIDE = range(5)

# The search for the end begins after this time without a contact. The unit is the mean interval
# between contacts.
PATIENCE = 2.0
# Before each step, the arrays have room for this many further contacts.
SPARE_CONTACTS = 64
# A contact is likely within a step H if the parabola that extrapolates the gap from the start of
# the step ends below this fraction of the distance v0 H.
LIKELY = 0.05

# These fields change as the bodies move.
_MOTION = [
    ("position", "f8"),  # x of the first particle; the gap if the target is a hard wall
    ("last_position", "f8"),  # position at the end of the last contact
    # momentum of the relative motion of both bodies, summed from impulses
    ("momentum", "f8"),
    ("chain_momentum", "f8"),  # momentum of the chain when soft bodies touched
    ("touching", "i8"),  # whether bodies overlap now
    ("active", "i8"),  # number of bonds that have begun to move
    ("first_contact", "f8"),  # time of the first contact
    ("last_contact", "f8"),  # time at which the last contact ended
    ("argue_after", "f8"),  # time after the last contact from which the end may be argued
    ("strain_min", "f8"),  # smallest and largest strain since the first contact
    ("strain_max", "f8"),
    ("contact_min", "f8"),  # smallest and largest strain up to the last contact
    ("contact_max", "f8"),
]
# These fields are set before a run and do not change.
_LIMITS = [
    ("impact_velocity", "f8"),  # v0
    ("contact_mass", "f8"),  # reduced mass of the particles in contact
    ("soft", "i8"),  # whether bodies overlap in a contact
    ("argue_first", "f8"),  # value of argue_after while there is only one contact
    ("patience", "f8"),  # value of argue_after in mean intervals between contacts
    # shortest substep near touching and parting, as a fraction of the step
    ("shortest_share", "f8"),
    ("grading", "f8"),  # ratio of a graded substep to its time from the event
    ("strain_floor", "f8"),  # a strain outside these limits stops the run
    ("strain_ceiling", "f8"),
    ("step_evaluations", "i8"),  # number of evaluations of all bond forces in one step
]
_COUNTERS = [
    ("steps", "i8"),  # number of full steps done
    ("contacts", "i8"),
    ("evaluations", "i8"),  # number of evaluations of all bond forces
    ("substeps", "i8"),  # number of substeps in the log of the loop
]
# All run states have the same dtype. Loops are selected by the types of their arguments, and NumPy
# would create a new type for each view of records.
RUN_STATE: Any = np.dtype((np.record, _MOTION + _LIMITS + _COUNTERS + SEARCH_FIELDS))


def argue_when_silent(run_state: Any, stiffness: float) -> None:
    """
    Let loops return ARGUE after `PATIENCE` mean intervals without a contact.

    `stiffness` is U''(1) divided by the least mass. It determines the interval while there is only
    one contact.
    """
    run_state["patience"] = PATIENCE
    run_state["argue_first"] = PATIENCE * math.pi / math.sqrt(2.0 * stiffness)
    run_state["argue_after"] = math.inf


def never_argue(run_state: Any) -> None:
    """Let loops never return ARGUE."""
    run_state["argue_after"] = run_state["argue_first"] = run_state["patience"] = math.inf


def is_likely(run_state: Any, start: tuple[float, float, float], ahead: float) -> bool:
    """Return whether a contact is likely within a time, from the gap and its derivatives."""
    reached = start[0] + ahead * (start[1] + 0.5 * ahead * start[2])
    return reached < LIKELY * ahead * run_state.impact_velocity


def record_contact(run_state: Any, contacts: Array, moment: float, speed: float) -> None:
    """Record the time and the closing speed at the start of a contact."""
    contacts[0, run_state.contacts] = moment
    contacts[1, run_state.contacts] = speed
    if run_state.contacts == 0:
        run_state.first_contact = moment
    run_state.contacts += 1


def begin_range(run_state: Any, low: float, high: float) -> None:
    """Set the range of strains at the first contact to the present extremes."""
    if run_state.contacts == 1 and low <= high:
        run_state.strain_min = low
        run_state.strain_max = high


def note_impulse(run_state: Any, contacts: Array, given: float) -> None:
    """Record the impulse of the last contact."""
    contacts[2, run_state.contacts - 1] = given
    run_state.momentum += given


def note_parting(run_state: Any, moment: float, low: float, high: float) -> None:
    """
    Record the end of a contact, and set the time after which an end may be argued.

    `low` and `high` are the smallest and the largest strain at this moment.
    """
    run_state.last_contact = moment
    run_state.contact_min = min(run_state.strain_min, low)
    run_state.contact_max = max(run_state.strain_max, high)
    if run_state.contacts == 1:
        run_state.argue_after = run_state.argue_first
    else:
        lasted = moment - run_state.first_contact
        run_state.argue_after = run_state.patience * lasted / (run_state.contacts - 1)


def extremes(values: Array, count: int) -> tuple[float, float]:
    """Return the smallest and the largest of the first `count` values; two NaN if any is NaN."""
    # Two loops can be vectorised; a single loop that propagates a NaN cannot.
    unknown = 0
    for i in range(count):
        unknown += not (-np.inf <= values[i] <= np.inf)
    low, high = np.inf, -np.inf
    for i in range(count):
        low = min(low, values[i])
        high = max(high, values[i])
    return (np.nan, np.nan) if unknown > 0 else (low, high)


def widen(run_state: Any, low: float, high: float) -> bool:
    """Extend the range of strains by the present extremes; return whether these are allowed."""
    run_state.strain_min = min(run_state.strain_min, low)
    run_state.strain_max = max(run_state.strain_max, high)
    return low > run_state.strain_floor and high < run_state.strain_ceiling


def may_be_over(run_state: Any, step: float) -> bool:
    """Return whether the bodies separate and have had no contact for a long time."""
    away = run_state.steps * step - run_state.last_contact
    return run_state.momentum > 0.0 and away >= run_state.argue_after and not run_state.touching
