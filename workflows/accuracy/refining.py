"""Refining: run at a step, see what it errs by, and take a smaller one, until that is enough."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from chaincor.workflows.errors import CostError, RunError, TimestepError

Found = TypeVar("Found")

# Steps that get smaller so many times without halving the error show that it is not the steps':
# each is 0.8 of the last at most, of order 4 at least, which should halve the error every time.
STALLED = 3
# Too large a step also makes particles meet or bonds break: so many steps, each about half of the
# one before, must say the same: a sixteenth of a guessed step is stable beyond doubt.
_CONFIRMATIONS = 4


@dataclass(frozen=True)
class Attempt(Generic[Found]):
    """What came of one step."""

    step: float  #: The step, or whatever else is made smaller.
    error: float  #: That of the number with it; inf where it did not run.
    found: Found | None = None  #: Its runs; None where it did not run.
    done: bool = False  #: Whether the search ends here.
    following: float = 0.0  #: The next step.
    #: Whether the next one is of another kind: what did not help so far does not count.
    anew: bool = False
    refusal: RunError | None = None  #: What stopped it.


@dataclass(frozen=True)
class Policy:
    """How a search goes on."""

    most: int  #: Steps that are tried.
    refused: float = 0.5  #: What is taken of a step that did not run.
    #: What may be cured by a smaller step; anything else ends the search.
    retried: tuple[type[RunError], ...] = (RunError,)
    believed: bool = True  #: Whether several refusals of one name are believed.
    stalls: bool = False  #: Whether the search ends where smaller steps have stopped to help.


def refine(
    step: float, attempt: Callable[[float], Attempt[Found]], policy: Policy
) -> list[Attempt[Found]]:
    """
    Try ever smaller steps; return all in turn.

    `attempt` runs at a step, and says what it errs by, whether that is enough, and which is next.
    Where time is up, what was found before serves. Raises RunError, what several steps agree on or
    what no smaller step cures; CostError where time is up and nothing was found.
    """
    tries: list[Attempt[Found]] = []
    while len(tries) < policy.most:
        try:
            tries.append(attempt(step))
        except CostError:
            if all(each.found is None for each in tries):
                raise
            break
        except policy.retried as refusal:
            tries.append(Attempt(step, math.inf, following=policy.refused * step, refusal=refusal))
            if policy.believed and _is_believed(tries):
                raise
        if tries[-1].done or (policy.stalls and has_stalled(tries)):
            break
        step = tries[-1].following
    return tries


def by_order(
    target_error: float, error: float, order: float, least: float, most: float = 0.8
) -> float:
    """Return the share of a step with which its error is a goal, between two bounds."""
    return min(max((target_error / max(error, 1e-300)) ** (1.0 / order), least), most)


def has_stalled(tries: Sequence[Attempt[Found]]) -> bool:
    """Return whether the last few steps that ran have not halved the error."""
    best, since, anew = math.nan, 0, False
    for each in tries:
        if each.refusal is not None:
            continue
        since = 0 if anew else since
        since = 0 if math.isnan(best) or each.error < 0.5 * best else since + 1
        best = each.error if math.isnan(best) else min(best, each.error)
        anew = each.anew
    return since == STALLED and tries[-1].refusal is None


def that_ran(tries: Sequence[Attempt[Found]]) -> list[Attempt[Found]]:
    """Return the steps that ran; raise what stopped the last where none did."""
    ran = [each for each in tries if each.refusal is None]
    if not ran:
        assert tries[-1].refusal is not None
        raise tries[-1].refusal
    return ran


def steps_record(tries: Sequence[Attempt[Found]], name: str = "timestep") -> list[dict[str, float]]:
    """Return steps and errors, for the record."""
    return [{name: each.step, "step_error": each.error} for each in tries]


def _is_believed(tries: Sequence[Attempt[Found]]) -> bool:
    """
    Return whether steps that became ever smaller agree on what stops them.

    The last few have been stopped by the same name, one that a smaller step does not cure.
    """
    kinds = [type(each.refusal) for each in tries[-_CONFIRMATIONS:]]
    return len(kinds) == _CONFIRMATIONS and set(kinds) == {kinds[0]} - {TimestepError, type(None)}
