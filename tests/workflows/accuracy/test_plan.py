"""Test which solver and numerics a scene gets, and that runs follow the plan."""

import json

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.plan import plan
from chaincor.workflows.accuracy.plans import plans
from chaincor.workflows.accuracy.solvers import LAMMPS, SOLVERS, solver_of
from chaincor.workflows.collision import collide
from chaincor.workflows.errors import RunError

HARMONIC = {"potential": "harmonic", "particles": 5, "velocity": 0.1}
SHARP = {"particles": 10, "speed": 30.0}


@pytest.mark.parametrize(
    ("fields", "solver"),
    [
        (HARMONIC, "exact modes"),
        (HARMONIC | {"contact": "power"}, "fixed steps"),
        ({"particles": 5}, "fixed steps"),
        (SHARP | {"masses": (1.0, 2.0)}, "fixed steps"),
        (SHARP, "adaptive steps"),
        (SHARP | {"particles": 3000}, "hard spheres"),
    ],
)
def test_the_first_solver_that_supports_a_scene_is_taken(fields, solver):
    scene = Scene(engine="reference", **fields)
    planned = plan(scene)
    assert planned.solver.name == solver
    # Each solver of higher preference gives in one line the reason why it does not support the
    # scene.
    for preferred in SOLVERS[: SOLVERS.index(planned.solver)]:
        reason = preferred.refusal(scene.problem)
        assert reason
        assert "\n" not in reason
    assert plan(scene.replace(engine="lammps")).solver.name == "LAMMPS"


def test_a_scene_that_no_solver_supports_is_refused_with_the_reason():
    scene = Scene(particles=10, contact="power", contact_stiffness=1e9)
    with pytest.raises(RunError, match=r"with contact_stiffness 1e\+09 the contact would vibrate"):
        solver_of(scene.problem, (LAMMPS,))
    assert "contact_stiffness" in plan(scene).refusal
    with pytest.raises(RunError, match="contact_stiffness"):
        collide(scene)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7])
@pytest.mark.parametrize("fields", [{"particles": 10}, {"potential": "toda", "particles": 7}])
def test_the_reference_engine_runs_what_is_planned(fields, tolerance):
    # In these scenes, the first step reaches the tolerance.
    scene = Scene(engine="reference", tolerance=tolerance, speed=0.3, **fields)
    planned, result = plan(scene), collide(scene)
    assert (result.scheme, result.timestep) == (planned.scheme, planned.numerics.timestep)
    shown = planned.to_dict()
    assert shown["proof_timesteps"] == [k * result.timestep for k in planned.proofs]


def test_lammps_runs_the_scheme_that_is_planned():
    scene = Scene(particles=6, speed=0.3, tolerance=1e-6)
    planned, result = plan(scene), collide(scene)
    assert result.scheme == planned.scheme
    # The reference run determines the step. Errors scatter by a factor of about 20, which for order
    # 4 or more is a factor of two in the step.
    assert 0.3 < result.timestep / planned.numerics.timestep < 3.0


def test_explicit_numerics_are_planned_as_given():
    given = Scene(particles=4, scheme="order4", timestep=0.03, engine="reference")
    planned, result = plan(given), collide(given)
    assert planned.target_error is None
    assert (result.scheme, result.timestep) == ("order4", planned.numerics.timestep)
    # Without the error bar there is one run.
    alone = plan(given.replace(error=False))
    assert alone.proofs == ()
    assert alone.seconds < planned.seconds


def test_a_dry_run_prints_the_plan_and_runs_nothing(chaincor, monkeypatch):
    monkeypatch.setattr("chaincor.workflows.collision.collide", lambda *_: pytest.fail("collides"))
    dry = ("run", "--dry-run", "--particles", "30")
    status, text, _ = chaincor(*dry)
    assert status == 0
    shown = {row.split()[0] for row in text.splitlines()}
    assert {"solver", "scheme", "reference", "expected"} <= shown
    _, text, _ = chaincor(*dry, "--json")
    planned = plan(Scene(particles=30)).to_dict()
    assert json.loads(text)["plan"] == json.loads(json.dumps(planned))
    status, text, errors = chaincor(*dry, "--contact", "power", "--contact-stiffness", "1e9")
    assert (status, text) == (1, "")
    assert errors.count("\n") == 1
    assert "contact_stiffness" in errors


def test_many_scenes_get_the_plans_that_each_gets_alone():
    common = {"particles": 10, "engine": "reference"}
    kinds = [{}, {"tolerance": 1e-9}, {"potential": "log"}, {"masses": (1.0, 2.0)}, SHARP]
    kinds += [{"particles": 900}, {"temperature": 1e-6}, {"scheme": "order4"}, {"compression": 0.1}]
    # At the highest speed, the solver is another one.
    speeds = (30.0, 0.01, 0.4, 1.7)
    scenes = [Scene(**{**common, "speed": v, **fields}) for v in speeds for fields in kinds]
    for scene, planned in zip(scenes, plans(scenes), strict=True):
        assert planned.to_dict() == plan(scene).to_dict()
        assert planned.problem is scene.problem
