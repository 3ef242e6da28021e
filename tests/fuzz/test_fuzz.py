"""Fuzz for a minute; ``make fuzz MINUTES=60`` fuzzes longer."""

from collections import Counter
from random import Random

import pytest

from tests.extremes.cases import Case
from tests.extremes.judging import call_in_process
from tests.fuzz.fuzzing import FOUND, HANG_SECONDS, faults_of, fuzz_files, fuzz_lines
from tests.fuzz.subjects import subjects
from tests.workflows.engines.reference.loops.test_cached_kernels import arguments, loop

KINDS = (
    *("text dump", "yaml dump", "extended XYZ", "ASE trajectory", "TRR", "NetCDF", "data file"),
    *("script", "log"),
    *("manifest", "table", "store", "cells of a store", "template", "sweep", "units"),
)


def test_every_kind_of_file_is_fuzzed():
    assert set(KINDS) == set(subjects())


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_is_whole_is_read(kind):
    subject = subjects()[kind]
    for command in subject.commands:
        answer = call_in_process(Case(command, subject.files, subject.outputs), HANG_SECONDS)
        assert answer.status in (0, 1), answer.stderr
        assert answer.stdout


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_spoilt_files_are_answered_or_refused_in_one_line(kind):
    fuzz_files(subjects()[kind], 40, 1, Counter())


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted(FOUND.glob("*/*")), ids=lambda path: path.parent.name)
def test_files_that_were_answered_wrongly_once(path):
    subject = subjects()[path.parent.name]
    for command in subject.commands:
        assert not faults_of(subject, command, path.read_bytes(), Counter())


@pytest.mark.slow
def test_random_command_lines_are_answered_or_refused_in_one_line():
    fuzz_lines(60, 1, Counter())


@pytest.mark.slow
def test_spoilt_loops_are_compiled_again(tmp_path, monkeypatch):
    expected = loop(tmp_path, monkeypatch)(*arguments())
    (path,) = tmp_path.glob("*.loop")
    whole = path.read_bytes()
    end_of_header = whole.index(b"\n", whole.index(b"\n") + 1)
    random = Random(1)
    for k in range(12):
        # Half of the changes are in the header, which names the symbol that is called.
        place = random.randrange(end_of_header if k % 2 else len(whole))
        changed = bytearray(whole)
        changed[place] ^= 1 << random.randrange(8)
        path.write_bytes(changed)
        again = loop(tmp_path, monkeypatch)
        assert again(*arguments()) == expected
        assert again.compiled == 1
