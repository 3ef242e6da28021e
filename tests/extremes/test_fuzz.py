"""
Test a sample of the bad inputs of ``tests.extremes.fuzz_inputs``, which tries twenty thousand.
"""

import pytest

from tests.extremes.body_cases import body_case
from tests.extremes.cases import case
from tests.extremes.judging import call_as_process, call_in_process, faults

BLOCK = 25
# The first call of each kind compiles loops, which takes ten seconds or more on a new machine.
HANG_SECONDS = 60.0


BLOCKS = [*((case, first) for first in range(0, 400, BLOCK))]
BLOCKS += [*((body_case, first) for first in range(0, 200, BLOCK))]


@pytest.mark.slow_cases
@pytest.mark.parametrize(("draw", "first"), BLOCKS)
def test_bad_input_is_answered_or_refused_in_one_line(draw, first):
    found = {}
    for number in range(first, first + BLOCK):
        made = draw(number)
        wrong = faults(made, call_in_process(made, HANG_SECONDS))
        if wrong:
            found[number] = (made.arguments, wrong)
    assert found == {}


@pytest.mark.slow
def test_real_processes_answer_alike():
    for number in range(4):
        made = case(number)
        answer = call_as_process(made)
        assert faults(made, answer) == []
        assert answer.status == call_in_process(made, HANG_SECONDS).status
