"""Prove the first contact within a step, or that there is none, and enclose its time."""

from flint import arb

from benchmarks.certified.flow import NotProvedError, Step

# Largest number of halvings of a time interval before a proof is abandoned. Contacts that graze the
# wall, at less than about 2^-40 of the other speeds, are not decided.
_MOST_HALVINGS = 40
_NEWTON_STEPS = 12

GAP = 0


def first_contact(step: Step, approach: int, *, leaves: bool) -> arb | None:
    """
    Return the time at which the gap first closes in a step; None if it provably stays open.

    Parameters
    ----------
    step : Step
        Enclosed motion.
    approach : int
        Index of the velocity of the first particle, which is the rate of change of the gap.
    leaves : bool
        Whether the step begins at the wall, which the particle has just left.

    Returns
    -------
    arb or None
        A ball of times that contains the first contact and no other contact.

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
    """Return a small ball around the only time at which a decreasing gap is zero."""
    slowest = abs(step.unknown(approach, begin.union(end))).lower()
    time = ((begin + end) / 2).mid()
    for _ in range(_NEWTON_STEPS):
        closer = (time - step.unknown(GAP, time) / step.unknown(approach, time)).mid()
        time = closer if begin < closer < end else time
    # The gap decreases at least at this rate, which bounds the distance of its zero.
    away = (abs(step.unknown(GAP, time)) / slowest).upper()
    return time + arb(0, away)
