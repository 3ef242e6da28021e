"""Test a user's integrator of two bodies, which receives a single line of particles."""

import json

import numpy as np
import pytest

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.tradeoff.study import tradeoff
from chaincor.workflows.validation.user_comparison import validate_user
from chaincor.workflows.validation.user_integrator import UserIntegratorError, run_user_integrator

# These integrators take velocity Verlet steps of the whole line. If the gap closes within a step,
# bisection finds the time of a hard contact. A soft contact is a further force.
MODULE = """
import numpy as np

def verlet(scene, h=2e-3):
    line, bond = scene.line, scene.bond
    m, gap = line.inverse_masses, line.gap

    def acceleration(s):
        force = np.asarray(bond.force(s), dtype=float)
        overlap = max(-s[gap], 0.0)
        force[gap] = line.contact.force(-overlap)
        return m * (np.concatenate((force, [0.0])) * -1.0 + np.concatenate(([0.0], force)))

    def step(s, v, h):
        half = v + 0.5 * h * acceleration(s)
        s = s + h * np.diff(half)
        return s, half + 0.5 * h * acceleration(s)

    s, v = line.strains.copy(), line.velocities.copy()
    if not line.soft:
        s[gap] = 0.0
    quiet, limit = 0.0, 3.0 * len(s) / scene.problem.slow_stiffness**0.5
    while quiet < limit:
        if not line.soft and s[gap] <= 0.0 and v[gap + 1] < v[gap]:
            given = 2.0 * line.contact_mass * (v[gap] - v[gap + 1])
            v[gap] -= given * m[gap]
            v[gap + 1] += given * m[gap + 1]
            quiet = 0.0
        new_s, new_v = step(s, v, h)
        if not line.soft and new_s[gap] < 0.0:
            low, high = 0.0, h
            for _ in range(40):
                middle = 0.5 * (low + high)
                if step(s, v, middle)[0][gap] < 0.0:
                    high = middle
                else:
                    low = middle
            new_s, new_v = step(s, v, low)
            new_s[gap] = 0.0
        s, v = new_s, new_v
        quiet = 0.0 if s[gap] < 0.0 else quiet + h
    first = line.first
    found = {"velocities": v[first:]}
    if not line.rigid:
        found["target_velocities"] = v[:first][::-1]
    return found

def forgets_the_target(scene):
    return np.zeros(scene.particles)

def too_many(scene):
    return {"velocities": np.zeros(scene.particles), "target_velocities": np.zeros(3)}

def ignores_masses(scene):
    found = verlet(scene.without("masses"))
    return found
"""
TARGET = Scene(
    potential="toda", particles=3, masses=[1, 2], target_particles=2, target_masses=[3], speed=0.3
)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow_cases
@pytest.mark.parametrize(
    "scene",
    [
        TARGET,
        TARGET.replace(contact="power", contact_stiffness=2.0),
        Scene(particles=3, masses=[2, 1], speed=0.3),
        Scene(potential="harmonic", particles=3, velocity=0.1, compression=0.03),
    ],
    ids=["target", "soft", "masses", "compressed"],
)
@pytest.mark.slow
def test_another_integrator_agrees(scene):
    # For Verlet at 2e-3, h^2 is 4e-6. For so few particles, the error is below h^2.
    found = validate_user(scene, "mine:verlet", tolerance=4e-6)
    assert found.agrees, found
    # The final velocities belong to a later time. They are shown but not judged.
    shown = {each.quantity: each.allowed for each in found.comparisons}
    assert ("target_velocities" in shown) == (scene.target_particles is not None)
    assert shown.get("target_velocities") is None


def test_one_that_ignores_masses_does_not():
    assert not validate_user(TARGET, "mine:ignores_masses", tolerance=4e-6).agrees


def test_both_bodies_are_asked_for(folder):
    with pytest.raises(UserIntegratorError, match="gives no target_velocities"):
        run_user_integrator("mine:forgets_the_target", TARGET, timeout=600.0)
    with pytest.raises(UserIntegratorError, match=r"target_velocities have shape \(3,\)\. Give"):
        run_user_integrator("mine:too_many", TARGET, timeout=600.0)
    np.savez(folder / "f.npz", velocities=np.zeros(3), target_velocities=np.zeros(2))
    assert run_user_integrator("f.npz", TARGET, 1.0).target_velocities.tolist() == [0.0, 0.0]
    with pytest.raises(UserIntegratorError, match="the scene has a rigid wall"):
        run_user_integrator("f.npz", Scene(particles=3), 1.0)
    (folder / "f.csv").write_text("velocity\n0\n0\n0\n")
    with pytest.raises(UserIntegratorError, match="or write an NPZ file"):
        run_user_integrator("f.csv", TARGET, 1.0)


def test_the_command_names_both_bodies(chaincor):
    (words := ["validate", "--against", "mine:verlet", "--tolerance", "4e-6"]).extend(
        ("--potential", "harmonic", "--particles", "2", "--masses", "1,2", "--velocity", "0.1")
    )
    for extra in ([], ["--json"]):
        status, out, _ = chaincor(*words, *extra)
        assert status == 0
        if extra:
            (found,) = json.loads(out)["validations"]
            assert found["masses"] == [1.0, 2.0]
        else:
            assert "v0 = 0.1, masses 1, 2" in out


def test_a_study_refuses_what_its_oracles_do_not_know():
    for fields in ({"masses": [1, 2]}, {"target_particles": 3}, {"compression": 0.01}):
        with pytest.raises(InputError, match=f"Leave out {next(iter(fields))}"):
            tradeoff(Scene(particles=4, **fields), quick=True)
