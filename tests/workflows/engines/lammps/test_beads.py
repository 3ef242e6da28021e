"""Test columns of beads in LAMMPS's granular styles: engine, jobs, order of the steps."""

import subprocess

import numpy as np
import pytest

from chaincor import Scene, collide, validate
from chaincor.lammps_inputs.errors import ChaincorError, SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.workflows.engines.lammps import engine
from chaincor.workflows.engines.lammps.library import find_lmp_command, lmp_environment
from chaincor.workflows.job import write_job


def beads(**fields):
    return Scene(**{"potential": "hertz", "velocity": 0.1, "particles": 6} | fields)


COLUMNS = [
    {},
    {"contact": "hard"},
    {"masses": (1.0, 3.0), "contact": "power", "contact_stiffness": 2.0},
    {"target_particles": 3, "target_masses": (2.0,)},
    {"diameters": (1.0, 0.9, 0.8), "masses": (1.0, 2.0)},
    {"diameters": (1.0, 0.6), "contact": "hard", "velocity": 0.02},
    {"hertz_exponent": 2.0, "masses": (1.0, 3.0)},
    {"hertz_exponent": 1.25, "contact": "hard", "velocity": 0.01},
    {"hertz_exponent": 3.0, "target_particles": 2, "particles": 3},
    {"contact": "power", "contact_exponent": 2.0, "particles": 3},
]


@pytest.mark.parametrize("fields", COLUMNS)
def test_both_engines_agree(fields):
    validation = validate(beads(**fields))
    assert validation.agrees, validation
    assert validation.comparisons[0].allowed < 3e-6
    named = [comparison.quantity for comparison in validation.comparisons]
    granular = not {"hertz_exponent", "diameters"} & fields.keys()
    assert ("table_restitution" in named) == granular


@pytest.mark.parametrize("law", ["viscoelastic", "dashpot"])
@pytest.mark.parametrize(
    "fields", [{}, {"contact": "hard"}, {"target_particles": 2}, {"diameters": (0.8, 1.2)}]
)
def test_damping_models_of_both_engines_are_one_law(law, fields):
    scene = beads(**fields, masses=(1.0, 2.0), damping=0.1, damping_law=law)
    known = collide(scene.replace(engine="reference"), tolerance=1e-8)
    steps = [0.04, 0.01, 0.0025]
    runs = engine.run_at_steps(scene.problem, Numerics(scheme="verlet", timestep=steps[0]), steps)
    errors = [abs(run.eta - known.restitution) for run in runs]
    # LAMMPS evaluates damping forces half a step earlier. The error is therefore of first order: a
    # quarter of the step has a quarter of the error.
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.3)
    assert errors[2] < 1e-3


@pytest.mark.parametrize("contact", [None, "hard"])
def test_granular_steps_are_of_second_order(contact):
    scene = beads(contact=contact, particles=10)
    known = collide(scene.replace(engine="reference"), tolerance=1e-10)
    steps = np.array([0.04, 0.02, 0.01])
    numerics = Numerics(scheme="verlet", timestep=float(steps[0]))
    runs = engine.run_at_steps(scene.problem, numerics, steps.tolist())
    errors = [abs(run.eta - known.restitution) for run in runs]
    # Half the step has a quarter of the error, apart from the phase of contacts within steps.
    order = np.log2(errors[0] / errors[-1]) / 2.0
    assert 1.6 < order < 2.5
    assert known.contacts == len(runs[-1].contact_times)
    assert runs[-1].ending.kind == "proved"


@pytest.mark.parametrize("fields", COLUMNS)
def test_a_job_prints_the_result_of_the_engine(fields, tmp_path):
    scene = beads(**fields)
    write_job(scene, tmp_path)
    run = subprocess.run(
        [find_lmp_command(), "-in", "in.chain"],
        cwd=tmp_path,
        env=lmp_environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    said = dict(line.split(" = ") for line in run.stdout.splitlines() if line.count(" = ") == 1)
    known = collide(scene.replace(engine="reference"), tolerance=1e-9)
    error = float(said["restitution_error"])
    assert error < 3e-6
    assert abs(float(said["restitution"]) - known.restitution) <= error


@pytest.mark.parametrize("contact", [None, "hard"])
def test_columns_with_gaps_or_overlaps_at_first(contact, tmp_path):
    path = tmp_path / "gaps.csv"
    path.write_text("strain\n0.1\n0.05\n-0.02\n0.2\n")
    for fields in ({"initial": path, "particles": 4}, {"compression": 0.01}):
        validation = validate(beads(contact=contact, **fields))
        assert validation.agrees, validation


def test_a_step_of_ones_own_is_taken():
    result = collide(beads(timestep=0.01))
    known = collide(beads(engine="reference"), tolerance=1e-9)
    assert result.timestep == 0.01
    assert abs(result.restitution - known.restitution) <= result.restitution_error < 1e-4


def test_beads_that_reach_the_next_but_one_are_refused(tmp_path):
    with pytest.raises(ChaincorError, match="second bead after"):
        collide(beads(velocity=0.5))
    with pytest.raises(SceneError, match=r"Give less than 0\.2"):
        write_job(beads(velocity=0.4), tmp_path)
    for wish in ("guards", "explain", "plain"):
        with pytest.raises(ChaincorError, match=f"without {wish}"):
            write_job(beads(), tmp_path, **{wish: True})
