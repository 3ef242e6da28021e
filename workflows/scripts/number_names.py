"""Name quantities and their errors for the sentences at the end of a study."""

import math
import re

from chaincor.workflows.scripts.answers import NumberAnswer
from chaincor.workflows.scripts.ladder_runs import NumberLadder

_PLAIN = re.compile(r"[\w:\[\]]+")
# A sentence gives the names and errors of at most MOST_LISTED quantities. It also names the
# remaining quantities if there are at most _MOST_NAMED of them.
MOST_LISTED, _MOST_NAMED = 3, 2


def name_of(number: NumberLadder) -> str:
    """Return the name of a quantity, in quotes if it is a pattern."""
    return number.name if _PLAIN.fullmatch(number.name) else f"'{number.name}'"


def listed(answers: list[NumberAnswer]) -> str:
    """Return the names and errors of quantities, sorted by the ratio of error to tolerance."""
    ranked = sorted(answers, key=lambda a: -a.error / (a.number.tolerance or 1e-300))
    said = [f"{name_in(a)} ({_error(a)})" for a in ranked[:MOST_LISTED]]
    left = ranked[MOST_LISTED:]
    if not left:
        return ", ".join(said)
    many = len(left) > _MOST_NAMED
    more = [f"{len(left)} more"] if many else [name_in(a) for a in left]
    return ", ".join([*said, *more[:-1]]) + f" and {more[-1]}"


def name_in(answer: NumberAnswer) -> str:
    """Return the name of the quantity that an answer judges."""
    return name_of(answer.number)


def _error(answer: NumberAnswer) -> str:
    """Write the error of one run and the tolerance."""
    known = f"error up to {answer.error:.2g}" if math.isfinite(answer.error) else "no bound"
    return (
        known
        if answer.number.tolerance is None
        else (f"{known}, {answer.number.tolerance:.2g} allowed")
    )


def all_of(answers: list[NumberAnswer]) -> str:
    """Return the names of the quantities, or only their count if they are many."""
    if len(answers) > MOST_LISTED:
        return f"{len(answers)} quantities"
    *first, last = map(name_in, answers)
    return f"{', '.join(first)} and {last}" if first else last
