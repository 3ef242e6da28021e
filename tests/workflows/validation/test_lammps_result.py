"""Test users' LAMMPS results against the reference engine, and the order of users' steps."""

import json

import pytest

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.job import write_job
from chaincor.workflows.validation.lammps_result import read_lammps_result
from tests.lmp import run_lmp

# The integrators are velocity Verlet with a mirror, and a function that ignores the step.
MODULE = """
import numpy as np

def mirror(scene):
    n, h = scene.particles, scene.timestep
    x, v = np.arange(n) + 0.0, -scene.impact_velocity * np.ones(n)
    v[0] *= -1.0
    def force():
        stretch = np.diff(x) - 1.0
        return np.append(stretch, 0.0) - np.append(0.0, stretch)
    f = force()
    for _ in range(int(20.0 / h)):
        v += 0.5 * h * f
        x += h * v
        if x[0] < 0.0:
            x[0], v[0] = -x[0], -v[0]
        f = force()
        v += 0.5 * h * f
    return v

def free(scene):
    # No contact follows: the springs alone, of second order, in what the second one has of the
    # momentum that the first would have.
    n, h = scene.particles, scene.timestep
    return np.full(n, 0.05) + h**2

def stepless(scene):
    return np.full(scene.particles, 0.05)
"""
SMALL = ("--potential", "harmonic", "--particles", "3", "--velocity", "0.1")


def test_a_job_that_ran_agrees_from_its_folder_and_its_log(tmp_path, chaincor):
    job = tmp_path / "job"
    write_job(Scene(particles=3, speed=0.3), job)
    assert run_lmp(job).returncode == 0
    for path in (job, job / "log.lammps"):
        words = ("--json",) if path == job else ("--json", "--tolerance", "1e-3")
        status, out, _ = chaincor("validate", "--against", str(path), *words)
        (found,) = json.loads(out)["validations"]
        assert status == 0
        assert found["particles"] == 3
        assert [c["quantity"] for c in found["comparisons"]] == ["restitution", "contacts"]


def test_a_dump_agrees_and_another_scene_does_not(tmp_path, chaincor):
    dump = tmp_path / "run" / "dump.lammpstrj"
    collide(Scene(potential="harmonic", particles=3, velocity=0.1, tolerance=1e-6, dump=dump))
    # Frames of the dump lie between contacts. The error bar comes from the digits of the file.
    for path in (dump, dump.parent):
        assert chaincor("validate", "--against", str(path), *SMALL, "--tolerance", "1e-4")[0] == 0
    status, out, _ = chaincor("validate", "--against", str(dump), "--masses", "1,2", *SMALL)
    assert status == 1
    assert "DIFFER" in out
    status, _, err = chaincor("validate", "--against", str(dump), *SMALL[:3], "4", *SMALL[4:])
    assert status == 2
    assert "has 3 particles, but the scene has 4. Give the scene of that run" in err


def test_a_log_without_a_result_is_refused(tmp_path, chaincor):
    log = tmp_path / "log.lammps"
    for text in ("LAMMPS (1 Jan 2025)\n", "LAMMPS (1 Jan 2025)\nrestitution = e\n"):
        log.write_text(text)
        with pytest.raises(InputError, match="no line 'restitution = NUMBER'"):
            read_lammps_result(log)
    status, _, err = chaincor("validate", "--against", str(log), *SMALL)
    assert status == 2
    assert len(err.strip().splitlines()) == 1


def test_a_log_of_one_run_may_say_its_result_twice(tmp_path):
    log = tmp_path / "log.lammps"
    log.write_text(
        'print "restitution = $r"\nrestitution = 0.75\nrestitution = 0.750\ncontacts = 4'
    )
    found = read_lammps_result(log)
    assert (found.restitution, found.restitution_error, found.contacts) == (0.75, None, 4)


def lammps(folder, script):
    (folder / "in.chain").write_text(script)
    return run_lmp(folder, "-log", "log.own")


def test_a_log_of_several_runs_is_refused(tmp_path, chaincor):
    lines = "variable v index 0.25 0.75\nlabel again\nprint 'restitution = $v'\nnext v\n"
    assert lammps(tmp_path, f"{lines}jump SELF again\n").returncode == 0
    status, _, err = chaincor("validate", "--against", str(tmp_path / "log.own"), *SMALL)
    assert status == 2
    assert len(err.strip().splitlines()) == 1
    assert (
        "holds 2 lines 'restitution = NUMBER', from 0.25 to 0.75. Write the log of each run" in err
    )


@pytest.mark.parametrize(
    ("end", "words"),
    [("bands 3", "it has 'ERROR: Unknown command: bands"), (None, "no line 'Total wall time: '")],
)
def test_a_log_of_a_run_that_was_stopped_is_refused(tmp_path, end, words):
    lammps(tmp_path, f"print 'restitution = 0.5'\n{end or ''}\n")
    log = tmp_path / "log.own"
    if end is None:
        for finished in ("", "quit\n", "log none\n"):
            lammps(tmp_path, f"print 'restitution = 0.5'\n{finished}")
            assert read_lammps_result(log).restitution == 0.5
        log.write_text(log.read_text().partition("log none")[0])  # like the log of a killed run
    with pytest.raises(InputError, match=words):
        read_lammps_result(log)


def test_a_job_that_was_stopped_before_it_printed_its_error_is_refused(tmp_path, chaincor):
    write_job(Scene(particles=3, speed=0.3), tmp_path)
    script = tmp_path / "in.chain"
    text = script.read_text()
    assert text.count('print           "restitution_error') == 1
    script.write_text(
        text.replace(
            'print           "restitution_error', 'quit\nprint           "restitution_error'
        )
    )
    assert run_lmp(tmp_path).returncode == 0
    assert "\nrestitution = " in (tmp_path / "log.lammps").read_text()
    status, _, err = chaincor("validate", "--against", str(tmp_path))
    assert status == 2
    assert "is from an unfinished run: it has no line 'restitution_error = '" in err


@pytest.mark.parametrize("name", ["p.txt", "p", "p.png.doc"])
def test_pictures_of_unknown_kinds_are_refused_before_anything_runs(
    tmp_path, monkeypatch, chaincor, name
):
    monkeypatch.chdir(tmp_path)
    # This scene would take hours, so that no run may begin.
    status, out, err = chaincor(
        "validate", "--plot", name, "--particles", "3000", "--tolerance", "1e-9"
    )
    assert (status, out) == (2, "")
    assert len(err.strip().splitlines()) == 1
    assert "Give .png, .pdf or .svg" in err
    assert not list(tmp_path.iterdir())


def test_a_file_of_another_kind_is_not_drawn_over(tmp_path, chaincor):
    mine = tmp_path / "a.png"
    mine.write_text("mine")
    status, out, err = chaincor("validate", "--plot", mine)
    assert (status, out, mine.read_text()) == (2, "", "mine")
    assert "holds something else" in err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "kind", "order"), [("mirror", "irregular", 1), ("free", "regular", 2)]
)
def test_a_ladder_tells_the_order(tmp_path, monkeypatch, chaincor, name, kind, order):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "stepper.py").write_text(MODULE)
    words = ("--against", f"stepper:{name}", "--timestep", "0.05", "--ladder", "--json")
    status, out, _ = chaincor("validate", *words, *SMALL)
    assert status == 0
    found = json.loads(out)
    assert len(found["timesteps"]) == 6
    assert found["verdict"] in (kind, "cannot tell" if kind == "irregular" else kind)
    if found["order"] is not None:
        assert abs(found["order"] - order) <= found["order_error"]


def test_a_ladder_needs_a_function_and_its_step(tmp_path, monkeypatch, chaincor):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "stepper.py").write_text(MODULE)
    for words, said in (
        (("--ladder",), "--against"),
        (("--against", "stepper:free", "--ladder"), "no time step is given"),
    ):
        status, _, err = chaincor("validate", *SMALL, *words)
        assert status == 2
        assert said in err


@pytest.mark.slow
def test_a_function_that_takes_no_step_is_named(tmp_path, monkeypatch, chaincor):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "stepper.py").write_text(MODULE)
    words = ("--against", "stepper:stepless", "--timestep", "0.05", "--ladder")
    status, _, err = chaincor("validate", *SMALL, *words)
    assert status == 2
    assert "scene.timestep" in err
