"""Test that a tolerance is reached with a valid error bar at low cost."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bars.honest import random_scene, try_scene
from chaincor.analysis.error_bar import ErrorBar
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy import fixed_steps, solve
from chaincor.workflows.accuracy.bounded_run import BoundedRun
from chaincor.workflows.accuracy.plan import plan
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.reference import stepping
from chaincor.workflows.engines.rounding import amplified_rounding
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import CrossingError, RunError, ToleranceError
from chaincor.workflows.measured import measured
from tests.reference_cases import CASES, case_name, case_scene

# The published values have this error.
PUBLISHED = 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=map(case_name, CASES))
def test_reference_values_in_house(case):
    result = collide(case_scene(case).replace(engine="reference"), tolerance=1e-9)
    # The further motion of a broken chain depends on the last digits.
    broke = case["potential"] == "lj" and case["speed_over_vstar"] > 0.7
    assert result.tolerance_met or (broke and result.ending == "open")
    assert abs(result.restitution - case["restitution"]) <= PUBLISHED + result.restitution_error
    assert result.contacts == case["contacts"]


QUICK = [case for case in CASES if case["particles"] <= 20]


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7])
@pytest.mark.parametrize("case", QUICK, ids=map(case_name, QUICK))
def test_reference_values_by_lammps(case, tolerance):
    result = collide(case_scene(case), tolerance=tolerance)
    assert result.tolerance_met
    assert result.restitution_error <= tolerance
    assert abs(result.restitution - case["restitution"]) <= PUBLISHED + result.restitution_error


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["lammps", "reference"])
def test_error_bars_of_random_scenes_are_honest(engine):
    # At least 99 % of 300 scenes have a valid error bar (python -m benchmarks.bars.honest). All of
    # the few scenes here must have one.
    random = np.random.default_rng(7)
    trials = [try_scene(random_scene(random, engine)) for _ in range(12)]
    answered = [t for t in trials if t.reported is not None]
    assert len(answered) >= 8
    assert [t for t in answered if t.true > t.reported + t.judge_error] == []
    assert [t for t in answered if t.met and t.reported > t.tolerance] == []


@pytest.mark.parametrize("engine", ["lammps", "reference"])
def test_a_looser_tolerance_costs_less(engine):
    scene = Scene(potential="lj", particles=50, speed=0.4, engine=engine)
    costs = []
    for tolerance in (1e-3, 1e-6, 1e-9):
        result = collide(scene, tolerance=tolerance)
        assert result.tolerance_met
        # No run may be far more exact than its tolerance requires.
        assert result.restitution_error > 1e-4 * tolerance
        costs.append(STEP_SCHEMES[result.scheme].evaluations / result.timestep)
    # Costs are force evaluations per unit of time. Steps of high order need fewer evaluations but
    # more other operations.
    loose, middle, tight = costs
    assert loose < 0.8 * min(middle, tight)
    assert middle < 1.2 * tight


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["lammps", "reference"])
@pytest.mark.parametrize(
    "fields",
    [
        {"potential": "harmonic", "particles": 10, "velocity": 0.1},
        {"potential": "lj", "particles": 12, "speed": 0.8},
        {"potential": "log", "particles": 6, "speed": 0.3},
    ],
    ids=["harmonic", "lj", "log"],
)
def test_a_tighter_wish_never_widens_the_bar(fields, engine):
    scene = Scene(engine=engine, **fields)
    # Tolerances between powers of ten are also tested, and tolerances below rounding, which no run
    # reaches.
    tolerances = [10.0 ** (-0.5 * k) for k in range(12, 29)]
    found = [collide(scene, tolerance=tolerance) for tolerance in tolerances]
    bars = np.array([result.restitution_error for result in found])
    assert np.all(np.diff(bars) <= 0.0), bars
    met = np.array([result.tolerance_met for result in found])
    assert np.all(bars[met] <= np.array(tolerances)[met])
    assert not met[-1]
    # All results agree with the most exact result within their error bars.
    etas = np.array([result.restitution for result in found])
    assert np.all(np.abs(etas - etas[-1]) <= bars + bars[-1])


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5, 1e-6])
@pytest.mark.parametrize(
    ("engine", "table"), [("lammps", "lammps_schemes"), ("reference", "reference_schemes")]
)
def test_the_scheme_is_that_of_the_measured_table(engine, table, tolerance):
    # The tolerances are powers of ten. The factor of 0.999 makes rounding irrelevant.
    usual = next(name for name, least in measured(table).items() if 0.999 * tolerance > least)
    scene = Scene(potential="lj", particles=10, speed=0.4, engine=engine)
    assert collide(scene, tolerance=tolerance).scheme == usual


@pytest.mark.parametrize(
    ("rounding", "rounding_sensitivity", "asked"),
    [(1e-3, 1e-3, 1), (1e-3, 1e-5, 3), (1e-7, 1e-7, 3)],
    ids=["no scheme can", "another scheme may", "looser ones may"],
)
def test_looser_goals_are_tried_where_they_can_help(
    monkeypatch, rounding, rounding_sensitivity, asked
):
    scene = Scene(potential="lj", particles=5, engine="reference")
    outcome = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.1))
    # The solver multiplies by amplified_rounding, so that the test divides by it.
    rounding_sensitivity /= amplified_rounding("reference", 1.0, scene.problem)
    found = BoundedRun(
        outcome, ErrorBar(step=1e-10, table=0.0, rounding=rounding), rounding_sensitivity
    )
    target_errors = []
    monkeypatch.setattr(
        solve, "solve_with_reference", lambda *given: target_errors.append(given[1]) or found
    )
    assert solve.solve_to_tolerance(plan(scene, 1e-9)).bar is found.bar
    assert target_errors == pytest.approx([1e-9, 1e-8, 1e-7][:asked])


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-11, 1e-12])
def test_the_default_scene_is_not_less_exact_for_being_asked_for_more(tolerance):
    looser = collide(Scene(), tolerance=10.0 * tolerance)
    assert collide(Scene(), tolerance=tolerance).restitution_error <= looser.restitution_error


def test_a_tolerance_below_the_rounding_of_lammps_is_refused_with_an_honest_bar():
    scene = Scene(potential="lj", particles=20, speed=1e-6)
    result = collide(scene, tolerance=1e-10)
    assert not result.tolerance_met
    assert "rounding" in result.reason
    reference_value = collide(scene.replace(engine="reference"), tolerance=1e-10)
    assert reference_value.tolerance_met
    error = abs(result.restitution - reference_value.restitution)
    assert error <= result.restitution_error <= 1e-3


def test_low_speeds_have_no_floor_in_house():
    # The limit is the harmonic chain of 20 particles; anharmonicity changes eta by about v/v*.
    limit = collide(Scene(potential="harmonic", particles=20, velocity=1e-13, engine="reference"))
    slow = Scene(potential="lj", particles=20, speed=1e-12, engine="reference")
    result = collide(slow, tolerance=1e-10)
    assert result.tolerance_met
    assert abs(result.restitution - limit.restitution) <= 1e-9


@pytest.mark.slow
def test_a_chain_that_amplifies_rounding_says_so_in_the_bar():
    # Composed steps of order 8, and adaptive steps of Dormand and Prince at 1e-13, agree on this
    # eta.
    eta = 0.73449049389
    scene = Scene(potential="log", particles=300, speed=1.0, engine="reference")
    result = collide(scene, tolerance=1e-8)
    assert result.error_parts.rounding > 5e-11  # 15 times the rounding error without amplification
    assert abs(result.restitution - eta) <= result.restitution_error


@pytest.mark.slow
def test_a_chain_too_sensitive_for_any_step_says_so():
    # Steps from 0.05 to 0.005 give scattered results between 0.7333 and 0.7338.
    scene = Scene(potential="log", particles=1000, speed=1.0, engine="reference")
    result = collide(scene)
    assert not result.tolerance_met
    assert "too sensitive" in result.reason or "amplifies rounding errors" in result.reason
    assert 1e-5 < result.restitution_error < 1e-2
    assert abs(result.restitution - 0.73355) <= result.restitution_error
    # Results at three steps agree to 2e-5 by chance, but those at other steps, which are no worse,
    # do not.
    assert result.error_parts.step > 1e-4


@pytest.mark.parametrize("part", [1e-10, 5e-7])
def test_masses_that_are_alike_take_the_way_of_equal_ones(part, monkeypatch):
    runs = []
    run = fixed_steps.run_reference
    monkeypatch.setattr(fixed_steps, "run_reference", lambda *given: runs.append(1) or run(*given))
    counts, found = [], []
    for masses in (None, (1.0,) * 11 + (1.0 + part,)):
        scene = Scene(potential="lj", particles=12, speed=0.4, engine="reference", masses=masses)
        found.append(solve.solve_to_tolerance(plan(scene, 1e-6)))
        counts.append(len(runs))
    equal, alike = found
    assert counts == [3, 6], "a run and those at twice and 1.3 times its step"
    assert alike.outcome.scheme == equal.outcome.scheme
    # eta and its error bar depend on masses smoothly, with derivatives of about 1.
    assert alike.outcome.timestep == pytest.approx(equal.outcome.timestep, rel=3.0 * part)
    assert alike.bar.total == pytest.approx(equal.bar.total, rel=30.0 * part + 1e-6)
    apart = alike.outcome.eta - equal.outcome.eta
    assert abs(apart) <= 10.0 * part + 1e-12


@pytest.mark.slow
def test_what_late_contacts_may_bring_does_not_hinge_on_which_motion_had_one():
    """Require equal bars although chance decides which of eight motions return to the wall."""
    bars = []
    for masses in (None, (1.0,) * 59 + (1.0000000001,)):
        scene = Scene(potential="lj", particles=60, speed=1.35, engine="reference", masses=masses)
        bars.append(solve.solve_to_tolerance(plan(scene, 1e-6)).bar.total)
    # The error bar depends on the energy of the piece at the wall, which numerical errors change by
    # 1e-4.
    assert bars[1] == pytest.approx(bars[0], rel=1e-3)


def test_a_chain_that_is_thrown_back_faster_than_it_came_is_refused_by_name():
    # The first step is so long that momenta overflow before a strain shows the crossing.
    scene = Scene(potential="toda", toda_b=1.0, particles=10, speed=100.0, engine="reference")
    with pytest.raises(CrossingError, match="two particles meet"):
        collide(scene)


@pytest.mark.parametrize(
    ("fields", "length"),
    # Masses of 1e12 give the bond an energy of 1e12 v0^2 = 2.6e9, which is r^-12/72 at r = 0.11.
    [({"compression": 0.9}, "0.1"), ({"masses": 1e12}, "0.11")],
)
def test_bonds_too_sharp_for_lammps_are_named_with_their_own_length(fields, length):
    with pytest.raises(RunError, match=f"compressed to about {length} of their length"):
        collide(Scene(particles=3, **fields), most_seconds=math.inf)


def test_a_bar_that_says_nothing_is_refused(monkeypatch):
    scene = Scene(potential="lj", particles=3, engine="reference")
    met = solve.solve_to_tolerance(plan(scene, 1e-6))
    unknown = replace(met, bar=replace(met.bar, step=57.0))
    monkeypatch.setattr(solve, "solve_with_reference", lambda *_: unknown)
    with pytest.raises(ToleranceError, match="says nothing"):
        solve.solve_to_tolerance(plan(scene, 1e-6))
