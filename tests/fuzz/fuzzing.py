"""Spoil files and command lines, and check that commands refuse them cleanly."""

from collections import Counter
from hashlib import sha256
from pathlib import Path
from random import Random
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from tests.extremes.body_cases import body_case
from tests.extremes.cases import Case, case
from tests.extremes.judging import call_in_process, faults
from tests.fuzz.subjects import Subject

# No command may take longer than this.
HANG_SECONDS = 20.0
_SETTINGS: dict[str, Any] = {
    "deadline": None,
    "database": None,
    "suppress_health_check": list(HealthCheck),
    "phases": (Phase.generate,),
}


# This folder has the files that commands once handled wrongly, with a subfolder for each kind.
FOUND = Path(__file__).parent / "found"


def faults_of(subject: Subject, command: tuple[str, ...], content: bytes, tried: Counter) -> Any:
    """Return the faults in a command's answer to a spoilt file; count its exit status."""
    made = Case(command, subject.files | {subject.file: content}, subject.outputs)
    answer = call_in_process(made, HANG_SECONDS)
    tried[subject.name, answer.status] += 1
    return faults(made, answer)


def fuzz_files(
    subject: Subject, examples: int, number: int, tried: Counter, keep: bool = False
) -> None:
    """
    Call commands with spoilt files of one kind; raise AssertionError for a fault.

    With `keep`, the file that caused the fault is kept in `FOUND`.
    """

    @seed(number)
    @settings(max_examples=examples, **_SETTINGS)
    @given(st.integers(0, 2**63), st.sampled_from(subject.commands))
    def call(chosen: int, command: tuple[str, ...]) -> None:
        spoilt = subject.spoil(Random(chosen), subject.files[subject.file])
        wrong = faults_of(subject, command, spoilt, tried)
        if wrong and keep:
            place = FOUND / subject.name / sha256(spoilt).hexdigest()[:12]
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(spoilt)
        assert not wrong, f"{subject.name}, spoilt by {chosen}, {' '.join(command)}: {wrong}"

    call()


def fuzz_lines(examples: int, number: int, tried: Counter) -> None:
    """Call random command lines; raise AssertionError for a fault."""

    @seed(number)
    @settings(max_examples=examples, **_SETTINGS)
    @given(st.integers(0, 2**40), st.sampled_from((case, case, body_case)))
    def call(chosen: int, draw: Any) -> None:
        made = draw(chosen)
        answer = call_in_process(made, HANG_SECONDS)
        tried["command line", answer.status] += 1
        wrong = faults(made, answer)
        assert not wrong, f"{draw.__name__} {chosen}, {made.arguments}: {wrong}"

    call()
