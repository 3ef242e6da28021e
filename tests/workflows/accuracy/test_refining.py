"""Test when the loop of refinement continues, stops, stalls and refuses."""

import math

import pytest

from chaincor.workflows.accuracy.refining import (
    STALLED,
    Attempt,
    Policy,
    by_order,
    completed_attempts,
    has_stalled,
    refine,
    steps_record,
)
from chaincor.workflows.errors import BarrierError, CostError, TimestepError


def trying(*outcomes, enough=0.0):
    """Return a function for attempts that gives these errors, or refusals, one after another."""
    left = list(outcomes)

    def attempt(step):
        outcome = left.pop(0)
        if isinstance(outcome, Exception):
            raise outcome
        return Attempt(step, outcome, "ran", done=outcome <= enough, following=0.5 * step)

    return attempt


def errors(tries):
    return [each.error for each in tries]


def test_it_ends_with_the_first_step_that_is_enough():
    tries = refine(1.0, trying(1e-3, 1e-5, 1e-9, 1e-12, enough=1e-6), Policy(10))
    assert steps_record(tries) == [
        {"timestep": 1.0, "step_error": 1e-3},
        {"timestep": 0.5, "step_error": 1e-5},
        {"timestep": 0.25, "step_error": 1e-9},
    ]
    assert tries[-1].done


def test_it_ends_after_so_many():
    tries = refine(1.0, trying(1.0, 0.1, 0.01, 1e-3), Policy(3))
    assert errors(tries) == [1.0, 0.1, 0.01]
    assert not tries[-1].done


def test_steps_that_do_not_halve_the_error_end_it_only_where_that_is_asked():
    found = (1.0, 0.1, 0.09, 0.2, 0.06, 0.05, 0.04)
    stuck = refine(1.0, trying(*found), Policy(7, stalls=True))
    assert errors(stuck) == [1.0, 0.1, 0.09, 0.2, 0.06], "three after the best"
    assert has_stalled(stuck)
    assert not has_stalled(stuck[:-1])
    assert len(refine(1.0, trying(*found), Policy(7))) == len(found)


def test_of_steps_of_another_kind_what_did_not_help_before_does_not_count():
    tries = [Attempt(1.0, 0.1, "ran") for _ in range(1 + STALLED)]
    assert has_stalled(tries)
    tries[-2] = Attempt(1.0, 0.1, "ran", anew=True)
    assert not has_stalled(tries)


def test_what_a_smaller_step_cures_is_retried():
    failure = TimestepError("too large")
    tries = refine(1.0, trying(failure, failure, 1e-9, enough=1e-6), Policy(10, refused=0.25))
    assert [each.step for each in tries] == [1.0, 0.25, 0.0625]
    assert errors(tries) == [math.inf, math.inf, 1e-9]
    assert [each.step for each in completed_attempts(tries)] == [0.0625]


def test_a_refusal_is_believed_when_four_steps_agree():
    barrier, large = BarrierError("over it"), TimestepError("too large")
    with pytest.raises(BarrierError):
        refine(1.0, trying(large, *[barrier] * 4), Policy(10))
    with pytest.raises(TimestepError):
        completed_attempts(refine(1.0, trying(*[large] * 6), Policy(6)))
    tries = refine(1.0, trying(*[barrier] * 5), Policy(5, believed=False))
    assert [each.refusal for each in tries] == [barrier] * 5


def test_what_is_not_retried_is_raised_at_once():
    with pytest.raises(BarrierError):
        refine(1.0, trying(BarrierError("over it"), 1e-9), Policy(5, retried=(TimestepError,)))


def test_what_ran_before_time_was_up_serves():
    late = CostError("too long")
    assert errors(refine(1.0, trying(0.1, late), Policy(5))) == [0.1]
    for outcomes in ((late,), (TimestepError("too large"), late)):
        with pytest.raises(CostError):
            refine(1.0, trying(*outcomes), Policy(5))


def test_a_step_is_shortened_by_the_order_within_bounds():
    assert by_order(1e-8, 2.0**8 * 1e-8, 8.0, 0.1) == pytest.approx(0.5)
    assert by_order(1e-8, 1.0, 2.0, 0.3) == 0.3
    assert by_order(1e-8, 1e-9, 2.0, 0.3) == 0.8
    assert by_order(1e-8, 0.0, 2.0, 0.3) == 0.8
