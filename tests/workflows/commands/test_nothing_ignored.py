"""Test that every key and option is used or refused by name."""

import numpy as np
import pytest

from chaincor.lammps_inputs.errors import InputError, SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.job import write_job
from chaincor.workflows.validation.comparison import validate
from chaincor.workflows.validation.grid import grid_around

SMALL = ("--particles", "4")


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("run", *SMALL, "--dump-frames", "5"), "dump_frames is 5.0, but there is no dump"),
        (("run", *SMALL, "--dump-frames", "each"), "'each' is neither a number nor contacts"),
        (("inputs", *SMALL, "--dump-frames", "5", "-o", "job"), "the job writes no dump"),
        (("run", *SMALL, "--no-error"), "choosing the numerics needs an error bar"),
        (
            ("run", *SMALL, "--tolerance", "1e-4", "--no-error"),
            "choosing the numerics needs an error bar",
        ),
        (("run", "--potential", "harmonic", "--table", "linear"), "table is for bond tables"),
        (
            ("inputs", "--potential", "harmonic", "--table-points", "77", "-o", "job"),
            "table_points is for bond tables",
        ),
        (("validate", *SMALL, "--timeout", "3"), "--timeout limits your own function"),
        (("validate", *SMALL, "--timeout", "3", "--against", "f.csv"), "--timeout limits your"),
        (("validate", *SMALL, "--scheme", "order8", "--against", "f.csv"), "scheme have no effect"),
        (("validate", "--grid", *SMALL, "--speed", "0.2"), "does not use particles, speed"),
        (("tradeoff", "--calibrate", *SMALL), "does not use particles"),
        (("tradeoff", "--calibrate", "--quick", "-o", "x"), "does not use output, quick"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_what_would_be_ignored_is_refused(arguments, complaint, chaincor, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, err = chaincor(*arguments)
    assert status == 2
    assert complaint in err
    assert err.count("\n") == 1
    assert out == ""
    assert not list(tmp_path.iterdir())


def test_arrays_are_written_from_python_too(tmp_path):
    scene = Scene(particles=4, tolerance=1e-4, engine="reference", arrays=tmp_path / "a.npz")
    result = collide(scene)
    with np.load(tmp_path / "a.npz") as arrays:
        assert np.array_equal(arrays["velocities"], result.velocities)


def test_a_judge_writes_nothing_over_the_subject(tmp_path):
    kept = tmp_path / "a.npz"
    validation = validate(Scene(particles=4, scheme="verlet", timestep=0.05, arrays=kept))
    with np.load(kept) as arrays:
        eta = (arrays["velocities"].mean() / Scene().impact_velocity) ** 2
    assert eta == pytest.approx(validation.restitution, rel=1e-12)
    assert abs(eta - validation.judge_restitution) > 1e-9


def test_a_comparison_without_bars_is_refused():
    with pytest.raises(InputError, match="the comparison needs error bars"):
        validate(Scene(particles=4, scheme="verlet", error=False))


def test_a_grid_keeps_tables_where_there_are_any():
    scenes = grid_around(Scene(table="linear", table_points=1000))
    assert {scene.table for scene in scenes if scene.potential != "harmonic"} == {"linear"}
    assert {scene.table for scene in scenes if scene.potential == "harmonic"} == {None}


def test_a_job_made_with_frames_can_be_run_again(tmp_path):
    """Run the saved scene: `dump_frames` belongs to the job, and the scene has no dump."""
    files = write_job(
        Scene(particles=4, scheme="verlet", dump_frames="contacts"), tmp_path, dump=True
    )
    assert "write_dump" in files[0].read_text()
    assert collide(Scene.from_file(tmp_path / "scene.toml")).contacts > 0


def test_a_tabulated_harmonic_bond_is_refused_as_an_object_too():
    from chaincor.lammps_inputs.bonds.potentials import Harmonic

    with pytest.raises(SceneError, match="LAMMPS has harmonic bonds without a table"):
        Scene(potential=Harmonic(), velocity=0.1, table="spline")


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (("--keep-jobs", "kept"), "1 of 1 collisions are run by the reference engine"),
        (("--dry-run", "--keep-jobs", "kept"), "ignores the options --keep-jobs"),
        (("--dry-run", "--scheduler", "tcp://x:1"), "ignores the options --scheduler"),
    ],
)
def test_a_sweep_says_what_it_does_not_use(options, complaint, chaincor, tmp_path):
    path = tmp_path / "s.toml"
    path.write_text('[scene]\nengine = "reference"\ntolerance = 1e-4\n[axes]\nparticles = [3]\n')
    status, _, err = chaincor("sweep", str(path), *options)
    assert status == 0
    assert complaint in err


@pytest.mark.slow
def test_a_study_says_what_of_a_scene_it_does_not_use(chaincor, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text('particles = 3\nscheme = "verlet"\nsave = "job"\n')
    status, _, err = chaincor("tradeoff", str(path), "--quick")
    assert status == 0
    assert "It ignores these keys of the scene: scheme, save" in err
