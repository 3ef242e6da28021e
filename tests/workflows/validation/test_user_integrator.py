"""Test which results a user's integrator may return, and that every fault gives one line."""

import numpy as np
import pytest

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows import cli
from chaincor.workflows.validation.user_integrator import UserIntegratorError, run_user_integrator

MODULE = """
import os, time
import numpy as np

def only_velocities(scene):
    return np.full(scene.particles, 0.05)

def raises(scene):
    raise ValueError("no\\nway")

def divides(scene):
    assert scene.velocity == scene.impact_velocity
    return 1.0 / 0

def hangs(scene):
    time.sleep(60)

def dies(scene):
    os._exit(3)

def returns_nothing(scene):
    return None

def returns_nan(scene):
    return [float("nan")] * scene.particles

def returns_another_shape(scene):
    return np.zeros((scene.particles, 3))

def returns_too_few(scene):
    return np.zeros(scene.particles - 1)

def returns_no_velocities(scene):
    return {"contact_times": [0.0]}

def returns_words(scene):
    return {"velocities": ["fast", "slow", "none"]}
"""
SCENE = Scene(potential="lj", particles=3, speed=0.4)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_final_velocities_are_enough():
    found = run_user_integrator("mine:only_velocities", SCENE, timeout=600.0)
    assert found.velocities.tolist() == [0.05] * 3
    assert found.contact_times is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("function", "says"),
    [
        ("raises", r"raised ValueError: no way \(mine\.py, line \d+: raise ValueError\(.*\)\)$"),
        ("divides", r"ZeroDivisionError: .* \(mine\.py, line \d+: return 1\.0 / 0\)$"),
        ("dies", "ended its process before it returned"),
        ("returns_nothing", "finite numbers|shape"),
        ("returns_nan", "not a list of finite numbers"),
        ("returns_another_shape", r"shape \(3, 3\)\. Give the shape \(3,\)"),
        ("returns_too_few", r"shape \(2,\)\. Give the shape \(3,\)"),
        ("returns_no_velocities", "gives no velocities"),
        ("returns_words", "raised ValueError"),
    ],
)
def test_what_a_function_does_wrong_is_one_line(function, says):
    with pytest.raises(UserIntegratorError, match=says) as raised:
        run_user_integrator(f"mine:{function}", SCENE, timeout=600.0)
    assert "\n" not in str(raised.value)


@pytest.mark.slow
def test_a_function_that_hangs_is_stopped():
    with pytest.raises(UserIntegratorError, match=r"did not return within 3 s.*--timeout"):
        run_user_integrator("mine:hangs", SCENE, timeout=3.0)


@pytest.mark.parametrize(
    ("against", "says"),
    [
        ("mine", "Give module:function, or a file"),
        ("mine:nobody", "cannot find mine:nobody"),
        ("nowhere:collide", "cannot find nowhere:collide"),
        ("nothing.csv", r"cannot read 'nothing.csv' \(No such file"),
    ],
)
def test_what_is_not_there(against, says):
    with pytest.raises(InputError, match=says):
        run_user_integrator(against, SCENE, timeout=600.0)


def test_files(folder):
    velocities, displacements = np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.01, -0.01])
    np.savez(folder / "mine.npz", velocities=velocities, contact_times=[0.0, 1.5])
    found = run_user_integrator("mine.npz", SCENE, timeout=1.0)
    assert found.velocities.tolist() == velocities.tolist()
    assert found.contact_times.tolist() == [0.0, 1.5]
    rows = zip(velocities, displacements, strict=True)
    text = "velocity,displacement\n" + "".join(f"{v:.17g},{u:.17g}\n" for v, u in rows)
    (folder / "mine.csv").write_text(text)
    found = run_user_integrator("mine.csv", SCENE, timeout=1.0)
    assert found.velocities.tolist() == velocities.tolist()
    assert found.displacements.tolist() == displacements.tolist()
    (folder / "bad.csv").write_text("velocity\n0.1\nfast\n0.2\n")
    with pytest.raises(InputError, match=r"not a number\. Give a CSV with a column 'velocity'"):
        run_user_integrator("bad.csv", SCENE, timeout=1.0)
    (folder / "bad.npz").write_bytes(b"PK\x03\x04 no archive")
    with pytest.raises(InputError, match=r"cannot read 'bad.npz'"):
        run_user_integrator("bad.npz", SCENE, timeout=1.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("def f(scene) return 1\n", "cannot import broken: SyntaxError: expected ':' (broken.py, "),
        ("1 / 0\n", "cannot import broken: ZeroDivisionError: division by zero"),
        ("raise SystemExit(3)\n", "cannot import broken: SystemExit: 3"),
        ("import nothing_of_the_kind\n", "No module named 'nothing_of_the_kind'"),
    ],
)
@pytest.mark.slow_cases
def test_a_module_that_cannot_be_imported_is_one_line(tmp_path, monkeypatch, capfd, text, words):
    (tmp_path / "broken.py").write_text(text)
    monkeypatch.chdir(tmp_path)
    assert cli.run_command_line(["validate", "--particles", "3", "--against", "broken:f"]) == 2
    err = capfd.readouterr().err  # includes that of the process that imports the module
    assert len(err.strip().splitlines()) == 1
    assert words in err


@pytest.mark.parametrize("against", ["broken.py", "broken.py:f"])
def test_a_python_file_is_refused_with_the_form_of_functions(tmp_path, monkeypatch, capfd, against):
    (tmp_path / "broken.py").write_text("def f(scene) return 1\n")
    monkeypatch.chdir(tmp_path)
    assert cli.run_command_line(["validate", "--particles", "3", "--against", against]) == 2
    err = capfd.readouterr().err
    assert len(err.strip().splitlines()) == 1
    assert "Give module:function, such as broken:f" in err
