"""Contacts within a step: that there is none before it, that it is one, and when."""

from flint import arb

from benchmarks.certified.flow import NotProvedError, Step

# Intervals of time are halved so often before a proof is given up: contacts that graze the wall,
# with a speed below about 2^-40 of the others', are not decided.
_MOST_HALVINGS = 40
_NEWTON_STEPS = 12

GAP = 0


def first_contact(step: Step, approach: int, *, leaves: bool) -> arb | None:
    """
    Return when the gap first closes within a step; None if it provably stays open.

    Parameters
    ----------
    step : Step
        The motion.
    approach : int
        Index of the velocity of the first particle, the rate at which the gap opens.
    leaves : bool
        Whether the step begins at the wall, which the particle has just left.

    Returns
    -------
    arb or None
        A ball of times in which there is exactly one contact, the first.

    Raises
    ------
    NotProvedError
        If neither a contact nor its absence can be proved.
    """
    zero = arb(0)
    return _first(step, approach, zero, step.length, _MOST_HALVINGS, leaves=leaves)


def _first(
    step: Step, approach: int, begin: arb, end: arb, halvings: int, *, leaves: bool
) -> arb | None:
    during = begin.union(end)
    at_wall = leaves and begin == 0
    opening = step.slope_from_zero(GAP, during) if at_wall else step.unknown(GAP, during)
    if opening > 0:
        return None
    if not at_wall and step.unknown(approach, during) < 0:
        if step.unknown(GAP, end) > 0:
            return None
        if step.unknown(GAP, begin) > 0 and step.unknown(GAP, end) < 0:
            return _sharpened(step, approach, begin, end)
    if halvings == 0:
        raise NotProvedError("a contact grazes the wall, or these digits do not tell it from none")
    middle = ((begin + end) / 2).mid()
    found = _first(step, approach, begin, middle, halvings - 1, leaves=leaves)
    if found is not None:
        return found
    return _first(step, approach, middle, end, halvings - 1, leaves=leaves)


def _sharpened(step: Step, approach: int, begin: arb, end: arb) -> arb:
    """Return a small ball around the one time at which a falling gap is zero."""
    slowest = abs(step.unknown(approach, begin.union(end))).lower()
    time = ((begin + end) / 2).mid()
    for _ in range(_NEWTON_STEPS):
        closer = (time - step.unknown(GAP, time) / step.unknown(approach, time)).mid()
        time = closer if begin < closer < end else time
    # The gap falls at least that fast all the while, so its zero is no farther than this.
    away = (abs(step.unknown(GAP, time)) / slowest).upper()
    return time + arb(0, away)
