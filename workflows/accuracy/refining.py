"""Refinement of steps: run at ever smaller steps until the error is small enough."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from chaincor.workflows.errors import CostError, RunError, TimestepError

Found = TypeVar("Found")

# If the error has not halved after this many refinements, it does not come from the steps. Each
# step is 0.8 of the last at most and the order at least 4, so the error should halve every time.
STALLED = 3
# A failure counts only if this many successive steps, each about half as long as the step before,
# have failed with one error. Too large a step can also make particles meet or bonds break, but a
# sixteenth of a guessed step is certainly stable.
_CONFIRMATIONS = 4


@dataclass(frozen=True)
class Attempt(Generic[Found]):
    """Result of one step."""

    step: float  #: Step, or another quantity that is refined.
    error: float  #: Error with this step; inf if it did not run.
    found: Found | None = None  #: Runs of the step; None if it did not run.
    done: bool = False  #: Whether the search ends here.
    following: float = 0.0  #: Next step.
    #: Whether the next step is of another kind, so that earlier errors do not count.
    anew: bool = False
    refusal: RunError | None = None  #: Error that stopped the step.


@dataclass(frozen=True)
class Policy:
    """Policy of a search."""

    most: int  #: Largest number of steps.
    refused: float = 0.5  #: Factor on a step that did not run.
    #: Errors that a smaller step may avoid; any other error ends the search.
    retried: tuple[type[RunError], ...] = (RunError,)
    believed: bool = True  #: Whether repeated errors of one kind end the search.
    stalls: bool = False  #: Whether the search ends if smaller steps no longer help.


def refine(
    step: float, attempt: Callable[[float], Attempt[Found]], policy: Policy
) -> list[Attempt[Found]]:
    """
    Return the attempts at ever smaller steps, in order.

    `attempt` runs at a step and returns its error, whether this is enough, and the next step. If
    the time is up, the attempts so far are returned. Raises RunError if several steps agree on it
    or if no smaller step cures it, and CostError if the time is up and no step has run.
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
    """Return the factor on a step that brings its error to the target error, within bounds."""
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
    """Return the attempts that ran; raise the last error if no attempt ran."""
    ran = [each for each in tries if each.refusal is None]
    if not ran:
        assert tries[-1].refusal is not None
        raise tries[-1].refusal
    return ran


def steps_record(tries: Sequence[Attempt[Found]], name: str = "timestep") -> list[dict[str, float]]:
    """Return the steps and errors for the record."""
    return [{name: each.step, "step_error": each.error} for each in tries]


def _is_believed(tries: Sequence[Attempt[Found]]) -> bool:
    """Return whether the last few steps failed with one error that no smaller step cures."""
    kinds = [type(each.refusal) for each in tries[-_CONFIRMATIONS:]]
    return len(kinds) == _CONFIRMATIONS and set(kinds) == {kinds[0]} - {TimestepError, type(None)}
