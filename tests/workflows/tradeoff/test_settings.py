"""Test the settings of a study, and the conversion of their steps to other scenes."""

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.tradeoff.settings import (
    STOCK_TIMESTEP,
    Setting,
    study_settings,
    time_unit,
)

LJ, HARMONIC = Scene(), Scene(potential="harmonic", velocity=0.1)


def series_of(scene, quick=False):
    return [ladder[0] for ladder in study_settings(scene, quick)]


def test_a_study_holds_every_engine_wall_scheme_and_table():
    found = series_of(LJ)
    assert len(found) == len({s.series for s in found})
    assert {s.engine for s in found} == {"lammps", "reference"}
    assert {s.wall for s in found} == {"event", "reflect"}
    assert {s.table for s in found} == {"linear", "spline", None}
    for engine in ("lammps", "reference"):
        schemes = {s.scheme for s in found if s.engine == engine and s.wall == "event"}
        assert schemes == {"verlet", "order4", "order6", "order8"}
    assert {s.series for s in series_of(LJ, quick=True)} < {s.series for s in found}


def test_springs_need_no_table():
    assert {s.table for s in series_of(HARMONIC)} == {None}


@pytest.mark.parametrize("quick", [False, True])
def test_ladders_go_down_and_hold_the_stock_recipe(quick):
    ladders = study_settings(LJ, quick)
    for ladder in ladders:
        steps = [setting.timestep for setting in ladder]
        assert steps == sorted(steps, reverse=True)
        assert len(set(steps)) == len(steps) > 1
    stock = [s.timestep for s in ladders[0] if s.wall == "reflect"]
    assert STOCK_TIMESTEP in stock


def test_steps_shrink_with_the_most_compressed_bond_but_not_those_of_the_stock_recipe():
    slow, fast = Scene(speed=0.01), Scene(speed=1.0)
    assert time_unit(fast, "event") < 0.7 * time_unit(slow, "event")
    assert time_unit(fast, "reflect") == time_unit(slow, "reflect") == pytest.approx(1.0)


def test_phases_are_nearby_steps():
    setting = Setting("lammps", "reflect", "verlet", "linear", 0.005)
    first, last = setting.numerics(LJ), setting.numerics(LJ, phase=1.0)
    assert first.timestep == 0.005
    assert last.timestep == pytest.approx(0.0049)
    assert first.wall == "reflect"
    # Linear tables are compared at a force error in units of the speed, which does not depend on
    # the range.
    assert first.force_error == pytest.approx(1e-7 * LJ.impact_velocity)
