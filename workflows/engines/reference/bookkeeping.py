"""What a run keeps count of, and what the end of a contact and of a step change in it."""

import math
from typing import Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.contact_search import SEARCH_FIELDS

# Why a loop came back: all steps done, the end may be near, no room for more contacts, more
# contacts in one step than make sense, a strain that is not allowed.
DONE, ARGUE, FULL, CROWDED, OUTSIDE = range(5)

# The end is looked for when particle 1 has been away for so many mean intervals between contacts.
PATIENCE = 2.0
# Room for the contacts of one step.
SPARE_CONTACTS = 64
# A contact within a step is likely where the parabola that the gap follows at first ends lower
# than this part of the way that the impact velocity would take it.
LIKELY = 0.05

# One type for all: loops are found by the types that they are told, and of each view of records
# NumPy would make a new one.
LEDGER: Any = np.dtype(
    (
        np.record,
        [
            ("position", "f8"),  # x of the first particle; before a hard wall the gap
            ("last_position", "f8"),  # the same when the last contact ended
            ("impact_velocity", "f8"),  # v0
            ("contact_mass", "f8"),  # reduced mass of the particles that meet
            ("momentum", "f8"),  # of the relative motion of the bodies, from the impulses
            ("chain_momentum", "f8"),  # of the chain when soft bodies touched
            ("first_contact", "f8"),  # when the bodies first met
            ("last_contact", "f8"),  # when the last contact ended
            ("argue_after", "f8"),  # the end is argued when so much time has passed since then
            ("argue_first", "f8"),  # the same after the first contact
            ("patience", "f8"),  # and that is so many mean intervals between contacts
            ("shortest_share", "f8"),  # of a step, next to moments of touching and parting
            ("grading", "f8"),  # steps beside them, over how far their nearer end stays away
            ("strain_min", "f8"),  # smallest and largest strain met
            ("strain_max", "f8"),
            ("contact_min", "f8"),  # the same up to the last contact
            ("contact_max", "f8"),
            ("strain_floor", "f8"),  # strains outside these stop the run
            ("strain_ceiling", "f8"),
            ("steps", "i8"),  # full steps done
            ("contacts", "i8"),
            ("soft", "i8"),  # whether bodies overlap when they meet
            ("touching", "i8"),  # whether they do now
            ("active", "i8"),  # bonds that have begun to move
            ("evaluations", "i8"),  # of all bond forces
            ("step_evaluations", "i8"),  # of one step
            ("substeps", "i8"),  # in the log
            *SEARCH_FIELDS,
            # Of a chain in a batch: when its step began, what is left of it, up to where its next
            # move goes, and what is known of that, see ``batch.lanes``.
            ("begun", "f8"),
            ("left", "f8"),
            ("move", "f8"),
            ("known", "i8"),
        ],
    )
)


def argue_when_silent(ledger: Any, stiffness: float) -> None:
    """
    Let loops come back for the end after `PATIENCE` mean intervals without a contact.

    `stiffness` is U''(1) over the least mass: it tells the interval while there is one contact.
    """
    ledger["patience"] = PATIENCE
    ledger["argue_first"] = PATIENCE * math.pi / math.sqrt(2.0 * stiffness)
    ledger["argue_after"] = math.inf


def never_argue(ledger: Any) -> None:
    """Let loops not come back for the end, however long there is no contact."""
    ledger["argue_after"] = ledger["argue_first"] = ledger["patience"] = math.inf


def is_likely(ledger: Any, start: tuple[float, float, float], ahead: float) -> bool:
    """Return whether a contact is likely within a time, by the gap, its rate and that of it."""
    reached = start[0] + ahead * (start[1] + 0.5 * ahead * start[2])
    return reached < LIKELY * ahead * ledger.impact_velocity


def record_contact(ledger: Any, contacts: Array, moment: float, speed: float) -> None:
    """Note a contact that begins, at a moment, with a closing speed."""
    contacts[0, ledger.contacts] = moment
    contacts[1, ledger.contacts] = speed
    if ledger.contacts == 0:
        ledger.first_contact = moment
    ledger.contacts += 1


def note_impulse(ledger: Any, contacts: Array, given: float) -> None:
    """Note the momentum that the last contact gave the chain."""
    contacts[2, ledger.contacts - 1] = given
    ledger.momentum += given


def note_parting(ledger: Any, moment: float, low: float, high: float) -> None:
    """
    Note when a contact ended, and after how much silence the end is argued from now on.

    `low` and `high` are the smallest and the largest strain of that moment.
    """
    ledger.last_contact = moment
    ledger.contact_min = min(ledger.strain_min, low)
    ledger.contact_max = max(ledger.strain_max, high)
    if ledger.contacts == 1:
        ledger.argue_after = ledger.argue_first
    else:
        lasted = moment - ledger.first_contact
        ledger.argue_after = ledger.patience * lasted / (ledger.contacts - 1)


def extremes(values: Array, count: int) -> tuple[float, float]:
    """Return the smallest and the largest of the first numbers; what is no number stays."""
    low, high = np.inf, -np.inf
    for i in range(count):
        # Also true of what is not a number.
        if not low <= values[i] and low == low:
            low = values[i]
        if not high >= values[i] and high == high:
            high = values[i]
    return low, high


def widen(ledger: Any, low: float, high: float) -> bool:
    """Note the smallest and the largest strain of a moment; return whether they are allowed."""
    ledger.strain_min = min(ledger.strain_min, low)
    ledger.strain_max = max(ledger.strain_max, high)
    return low > ledger.strain_floor and high < ledger.strain_ceiling


def may_be_over(ledger: Any, step: float) -> bool:
    """Return whether the bodies part and have been silent for so long that the end is argued."""
    away = ledger.steps * step - ledger.last_contact
    return ledger.momentum > 0.0 and away >= ledger.argue_after and not ledger.touching
