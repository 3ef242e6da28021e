"""A minute of fuzzing; ``make fuzz MINUTES=60`` goes on for longer."""

from collections import Counter

import pytest

from tests.fuzz.fuzzing import fuzz_files, fuzz_lines
from tests.fuzz.subjects import subjects

KINDS = (
    *("text dump", "yaml dump", "extended XYZ", "TRR", "NetCDF", "data file", "script", "log"),
    *("manifest", "table", "store", "cells of a store", "template", "sweep", "units"),
)


def test_every_kind_of_file_is_fuzzed():
    assert set(KINDS) == set(subjects())


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_spoilt_files_are_answered_or_refused_in_one_line(kind):
    fuzz_files(subjects()[kind], 40, 1, Counter())


@pytest.mark.slow
def test_random_command_lines_are_answered_or_refused_in_one_line():
    fuzz_lines(60, 1, Counter())
