"""Test the statements on comparisons that prove little, and on points without comparison."""

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.figures.agreement import examine_points
from chaincor.workflows.reproduce.measurements import Answer, MeasuredPoint, Measurements
from chaincor.workflows.reproduce.plan import QUICK


def answer(eta: float, bar: float) -> Answer:
    met = bar <= QUICK.tolerance
    return Answer({"restitution": eta, "restitution_error": bar, "tolerance_met": met})


def scene(speed: float) -> Scene:
    return Scene(potential="lj", particles=100, speed=speed, tolerance=QUICK.tolerance)


@pytest.fixture(scope="module")
def health():
    refused = Answer({}, failure="RunError: too sharp")
    points = (
        MeasuredPoint(scene(0.1), answer(0.9, 1e-6), answer(0.9, 1e-7)),
        MeasuredPoint(scene(1.5), answer(0.795, 9e-3), answer(0.807, 1e-1)),
        MeasuredPoint(scene(2.0), answer(0.9, 5e-3), answer(0.9, 1e-7)),
        MeasuredPoint(scene(4.0), refused, answer(0.99, 1e-6)),
        MeasuredPoint(scene(5.0), refused, refused),
        MeasuredPoint(scene(0.2).replace(particles=2000), None, answer(0.9, 1e-6)),
    )
    return examine_points(Measurements(QUICK, (), {"curves": points, "increase": (), "slopes": ()}))


def test_comparisons_with_large_bars_are_named(health):
    assert (health["points"], health["compared"], health["disagreements"]) == (6, 3, 0)
    assert health["blunt"] == ["lj, n = 100, 1.5 v*", "lj, n = 100, 2 v*"]
    assert health["blunt_bars"] == pytest.approx([5e-3, 0.109], rel=1e-3)
    assert health["sharp"] == pytest.approx(10.0 * QUICK.tolerance)


def test_difference_larger_than_the_error_asked_is_named_and_is_the_bar(health):
    assert health["apart"] == ["lj, n = 100, 1.5 v* by 0.012"]
    assert health["largest_error"] == pytest.approx(0.012)
    assert health["missed"] == ["lj, n = 100, 1.5 v*"]


def test_points_not_given_to_lammps_are_distinguished_from_failures(health):
    # LAMMPS gave results at 0.1 and 1.5 v*; at 2 v*, its error exceeds the tolerance.
    assert health["by_lammps"] == 2
    assert health["not_given"] == ["lj, n = 100, 4 v*, LAMMPS: RunError: too sharp"]
    assert [text.split(":")[0] for text in health["failures"]] == [
        "lj, n = 100, 5 v*, LAMMPS",
        "lj, n = 100, 5 v*, reference engine",
    ]


def test_points_that_nothing_checks_are_counted(health):
    """Count a point not given to LAMMPS and a longer chain, but not a point without result."""
    assert (health["alone"], health["longest_compared"]) == (2, 100)
