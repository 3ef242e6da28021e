"""Refine steps: run at ever smaller steps until the error is small enough."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from chaincor.workflows.errors import CostError, RunError, TimestepError

Found = TypeVar("Found")

# If the error has not halved after this many refinements, it does not come from the steps. Each
# step is at most 0.8 times the previous step, and the order is at least 4; each refinement should
# therefore halve the error.
STALLED = 3
# The search ends with a failure only if runs at this many successive steps, each about half as long
# as the previous one, have failed with the same error. A step that is too large can also make
# particles collide or bonds break, but a sixteenth of a guessed step is certainly stable.
_CONFIRMATIONS = 4


@dataclass(frozen=True)
class Attempt(Generic[Found]):
    """Result of an attempt at one step."""

    step: float  #: Time step, or another quantity that is refined.
    error: float  #: Error at this step; inf if no run succeeded.
    found: Found | None = None  #: Runs at this step; None if no run succeeded.
    done: bool = False  #: Whether the search ends here.
    following: float = 0.0  #: Next step.
    #: Whether the search starts again with the next step, and earlier errors no longer count.
    anew: bool = False
    refusal: RunError | None = None  #: Error that stopped the runs at this step.


@dataclass(frozen=True)
class Policy:
    """Rules for ending a search."""

    most: int  #: Largest number of attempts.
    refused: float = 0.5  #: Factor from a step whose run failed to the next step.
    #: Errors that a smaller step may avoid; any other error stops the search.
    retried: tuple[type[RunError], ...] = (RunError,)
    believed: bool = True  #: Whether repeated errors of the same kind end the search.
    stalls: bool = False  #: Whether the search also ends if smaller steps no longer help.


def refine(
    step: float, attempt: Callable[[float], Attempt[Found]], policy: Policy
) -> list[Attempt[Found]]:
    """
    Return the attempts at ever smaller steps, in order.

    `attempt` runs at a step and returns the error, whether the search is done, and the next step.
    At the time limit, the attempts so far are returned. Raises a RunError that several successive
    steps cause, or that a smaller step cannot avoid. Raises CostError at the time limit if no run
    has succeeded.
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
    """Return the factor on the step that reduces its error to the target, within limits."""
    return min(max((target_error / max(error, 1e-300)) ** (1.0 / order), least), most)


def has_stalled(tries: Sequence[Attempt[Found]]) -> bool:
    """Return whether the last few successful attempts have not halved the error."""
    best, since, anew = math.nan, 0, False
    for each in tries:
        if each.refusal is not None:
            continue
        since = 0 if anew else since
        since = 0 if math.isnan(best) or each.error < 0.5 * best else since + 1
        best = each.error if math.isnan(best) else min(best, each.error)
        anew = each.anew
    return since == STALLED and tries[-1].refusal is None


def completed_attempts(tries: Sequence[Attempt[Found]]) -> list[Attempt[Found]]:
    """Return the successful attempts; raise the last error if there are none."""
    ran = [each for each in tries if each.refusal is None]
    if not ran:
        assert tries[-1].refusal is not None
        raise tries[-1].refusal
    return ran


def steps_record(tries: Sequence[Attempt[Found]], name: str = "timestep") -> list[dict[str, float]]:
    """Return the steps and errors for the record."""
    return [{name: each.step, "step_error": each.error} for each in tries]


def _is_believed(tries: Sequence[Attempt[Found]]) -> bool:
    """Return whether the last few steps failed with an error that smaller steps cannot avoid."""
    kinds = [type(each.refusal) for each in tries[-_CONFIRMATIONS:]]
    return len(kinds) == _CONFIRMATIONS and set(kinds) == {kinds[0]} - {TimestepError, type(None)}
