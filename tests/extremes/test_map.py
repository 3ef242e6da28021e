"""Test that no cell in the bounded map of the extremes is wrong."""

import pytest

from benchmarks.extremes.cells import Cell, Found, all_cells
from benchmarks.extremes.map import Map
from benchmarks.extremes.verdicts import verdict, verdicts

CELL = Cell("lj", 10, 0.4)


def found(by="reference", **fields):
    return Found(CELL.potential, CELL.particles, CELL.speed, by, 0.1, **fields)


JUDGE = found("judge", restitution=0.8, error=1e-10)


@pytest.mark.parametrize(
    ("said", "judged", "colour"),
    [
        ({"restitution": 0.8, "error": 1e-7, "met": True}, JUDGE, "green"),
        ({"restitution": 0.8 + 2e-7, "error": 1e-7, "met": True}, JUDGE, "red"),
        ({"restitution": 0.9, "error": 0.2, "message": "rounding"}, JUDGE, "amber"),
        ({"restitution": 0.9, "error": 0.2, "met": True}, JUDGE, "red"),
        ({"restitution": float("nan"), "error": 1e-7, "met": True}, JUDGE, "red"),
        ({"failure": "CrossingError", "message": "lower the speed"}, JUDGE, "red"),
        ({"failure": "RunError", "message": "use engine 'reference'"}, JUDGE, "amber"),
        ({"failure": "RunError", "message": "no"}, JUDGE, "red"),
        ({"failure": "ZeroDivisionError", "named": False, "message": "use it"}, JUDGE, "red"),
        ({"failure": "TimeOut", "named": False}, JUDGE, "red"),
        ({"restitution": 0.8, "error": 1e-7, "met": True}, None, "unverified"),
    ],
)
def test_rules(said, judged, colour):
    assert verdict(found(**said), judged).colour == colour


@pytest.mark.slow
def test_no_cell_of_the_bounded_map_is_wrong_and_it_resumes(tmp_path):
    cells = [(cell, engine) for cell, engine in all_cells(quick=True) if cell.particles in (1, 10)]
    path = tmp_path / "cells.jsonl"
    assert Map(path).run(cells, workers=2) > len(cells)
    path.write_text(path.read_text()[:-40])  # cut off in the middle of a line
    again = Map(path)
    assert again.run(cells, workers=1) == 1
    judged = verdicts(again.found, cells)
    assert len(judged) == len(cells)
    wrong = [(key, each) for key, each in judged.items() if each.colour in ("red", "unverified")]
    assert not wrong
    assert {each.colour for each in judged.values()} == {"green", "amber"}
