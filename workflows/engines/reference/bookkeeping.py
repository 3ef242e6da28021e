"""Scalar state of a run, and its changes at the end of a contact and of a step."""

import math
from typing import Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.contact_search import SEARCH_FIELDS

# A loop returns for one of these reasons: all steps are done, the end may be near, there is no room
# for more contacts, one step has too many contacts, or a strain is not allowed.
DONE, ARGUE, FULL, CROWDED, OUTSIDE = range(5)

# The end is sought this long after a contact, in mean intervals between contacts.
PATIENCE = 2.0
# One step has room for this many contacts.
SPARE_CONTACTS = 64
# A contact within a step is likely if the parabola of the gap at the start ends below this fraction
# of the distance that the impact velocity covers in the step.
LIKELY = 0.05

# All run states have one type, because loops are found by the types of their arguments, and NumPy
# would make a new type for each view of records.
RUN_STATE: Any = np.dtype(
    (
        np.record,
        [
            ("position", "f8"),  # x of the first particle; before a hard wall the gap
            ("last_position", "f8"),  # position at the end of the last contact
            ("impact_velocity", "f8"),  # v0
            ("contact_mass", "f8"),  # reduced mass of the particles in contact
            ("momentum", "f8"),  # momentum of the relative motion of the bodies, from the impulses
            ("chain_momentum", "f8"),  # momentum of the chain when soft bodies touched
            ("first_contact", "f8"),  # time of the first contact
            ("last_contact", "f8"),  # time at which the last contact ended
            ("argue_after", "f8"),  # time after the last contact from which the end is argued
            ("argue_first", "f8"),  # the time above, if only the first contact has occurred
            ("patience", "f8"),  # the time above, in mean intervals between contacts
            # shortest substep near touching and parting, in parts of a step
            ("shortest_share", "f8"),
            ("grading", "f8"),  # length of graded substeps over their distance from the event
            ("strain_min", "f8"),  # smallest and largest strain since the first contact
            ("strain_max", "f8"),
            ("contact_min", "f8"),  # smallest and largest strain up to the last contact
            ("contact_max", "f8"),
            ("strain_floor", "f8"),  # strains outside these stop the run
            ("strain_ceiling", "f8"),
            ("steps", "i8"),  # full steps done
            ("contacts", "i8"),
            ("soft", "i8"),  # whether bodies overlap in a contact
            ("touching", "i8"),  # whether bodies overlap now
            ("active", "i8"),  # bonds that have begun to move
            ("evaluations", "i8"),  # evaluations of all bond forces
            ("step_evaluations", "i8"),  # evaluations of one step
            ("substeps", "i8"),  # number of substeps in the log
            *SEARCH_FIELDS,
            # For a chain in a batch: the time at which its step began, the rest of this step, the
            # end of its next move, and the knowledge of this move, see ``batch.lanes``.
            ("begun", "f8"),
            ("left", "f8"),
            ("move", "f8"),
            ("known", "i8"),
        ],
    )
)


def argue_when_silent(run_state: Any, stiffness: float) -> None:
    """
    Let loops return for the end after `PATIENCE` mean intervals without a contact.

    `stiffness` is U''(1) over the least mass; it gives the interval while there is only one
    contact.
    """
    run_state["patience"] = PATIENCE
    run_state["argue_first"] = PATIENCE * math.pi / math.sqrt(2.0 * stiffness)
    run_state["argue_after"] = math.inf


def never_argue(run_state: Any) -> None:
    """Let loops never return for the end."""
    run_state["argue_after"] = run_state["argue_first"] = run_state["patience"] = math.inf


def is_likely(run_state: Any, start: tuple[float, float, float], ahead: float) -> bool:
    """Return whether a contact is likely within a time, by the gap and its derivatives."""
    reached = start[0] + ahead * (start[1] + 0.5 * ahead * start[2])
    return reached < LIKELY * ahead * run_state.impact_velocity


def record_contact(run_state: Any, contacts: Array, moment: float, speed: float) -> None:
    """Record the start of a contact, with its time and closing speed."""
    contacts[0, run_state.contacts] = moment
    contacts[1, run_state.contacts] = speed
    if run_state.contacts == 0:
        run_state.first_contact = moment
    run_state.contacts += 1


def begin_range(run_state: Any, low: float, high: float) -> None:
    """Begin the range of strains at the first contact, with the extremes `low` and `high`."""
    if run_state.contacts == 1 and low <= high:
        run_state.strain_min = low
        run_state.strain_max = high


def note_impulse(run_state: Any, contacts: Array, given: float) -> None:
    """Record the impulse of the last contact on the chain."""
    contacts[2, run_state.contacts - 1] = given
    run_state.momentum += given


def note_parting(run_state: Any, moment: float, low: float, high: float) -> None:
    """
    Record the end of a contact, and set the time after which the end is argued.

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
    """Return the smallest and the largest of the first numbers; two NaN if one of them is NaN."""
    # Both loops are vectorised, which a single loop that keeps a NaN is not.
    unknown = 0
    for i in range(count):
        unknown += not (-np.inf <= values[i] <= np.inf)
    low, high = np.inf, -np.inf
    for i in range(count):
        low = min(low, values[i])
        high = max(high, values[i])
    return (np.nan, np.nan) if unknown > 0 else (low, high)


def widen(run_state: Any, low: float, high: float) -> bool:
    """Record the extreme strains of a moment; return whether they are allowed."""
    run_state.strain_min = min(run_state.strain_min, low)
    run_state.strain_max = max(run_state.strain_max, high)
    return low > run_state.strain_floor and high < run_state.strain_ceiling


def may_be_over(run_state: Any, step: float) -> bool:
    """Return whether the bodies separate and the end may be argued after a long silence."""
    away = run_state.steps * step - run_state.last_contact
    return run_state.momentum > 0.0 and away >= run_state.argue_after and not run_state.touching
