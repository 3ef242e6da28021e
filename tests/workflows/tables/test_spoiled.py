"""Test that no spoiled table with a wrong force in LAMMPS is called good."""

import pytest

from tests.workflows.tables.spoiled import FAULTS, SOUND, error_of_lammps, error_of_model, judged

_TOLERANCE = 0.01
# Fraction of the tables that the command may judge wrongly.
_PART = 0.01


def _counts(folder, cases, reference_value, names=tuple(FAULTS)):
    missed, refused, spoiled, sound = [], [], 0, 0
    for name, case, true, report in judged(
        folder, names, tolerance=_TOLERANCE, cases=cases, reference_value=reference_value
    ):
        if name == "sound":
            sound += 1
            # Sound tables must themselves have an error below the tolerance.
            assert true < _TOLERANCE
            refused += [case.name] * (not report.is_good)
        else:
            spoiled += 1
            missed += [(name, case.name, true)] * (report.is_good and true > _TOLERANCE)
    return missed, refused, spoiled, sound


def test_a_core_a_well_a_long_range_and_few_rows(tmp_path):
    names = {"lj", "deep morse", "few harmonic", "dihedral"}
    cases = [case for case in SOUND if case.name in names]
    faults = ("few digits", "sign beyond", "one-sided difference", "shifted column", "step", "gap")
    missed, refused, _, sound = _counts(tmp_path, cases, error_of_model, faults)
    assert sound == len(names)
    assert (missed, refused) == ([], [])


@pytest.mark.slow
def test_spoiled_tables_against_lammps_itself(tmp_path):
    """Judge a quarter of the study; ``python -m tests.workflows.tables.spoiled`` judges all."""
    missed, refused, spoiled, sound = _counts(tmp_path, SOUND[::4], error_of_lammps)
    assert (spoiled, sound) == (112, 7)
    assert len(missed) <= _PART * spoiled, missed
    assert refused == []
