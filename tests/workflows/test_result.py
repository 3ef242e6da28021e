"""Test the JSON and the arrays of a collision's result."""

import dataclasses
import json

import numpy as np
import pytest

from chaincor.analysis.error_bar import ErrorBar
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.result import ARRAY_FIELDS


@pytest.fixture(scope="module")
def result():
    return collide(Scene(potential="lj", particles=10, speed=0.4, scheme="verlet", timestep=0.02))


def test_error_bars_add_up():
    assert ErrorBar(step=1e-6, table=2e-7, rounding=3e-8).total == pytest.approx(1.23e-6)
    assert ErrorBar(step=None, table=2e-7, rounding=3e-8).total is None


def test_identities(result):
    n, v0 = result.particles, result.velocity
    assert result.restitution == pytest.approx((result.velocities.mean() / v0) ** 2, rel=1e-14)
    assert result.kinematic_restitution**2 == pytest.approx(result.restitution, rel=1e-14)
    assert result.contacts == len(result.contact_times) == len(result.contact_speeds)
    assert result.last_contact_time == result.contact_times[-1]
    assert result.contact_times[0] == 0.0
    assert result.contact_speeds[0] == pytest.approx(v0, rel=1e-15)
    assert result.momentum_residual <= 1e-12
    assert result.speed == pytest.approx(0.4, rel=1e-12)
    # Mode 0 is the translation. Its energy is n times half the squared mean velocity.
    assert result.mode_energies[0] == pytest.approx(0.5 * n * v0**2 * result.restitution, rel=1e-12)
    assert len(result.mode_energies) == n


def test_the_error_bar_covers_the_error(result):
    exact = collide(Scene(potential="lj", particles=10, speed=0.4, tolerance=1e-9))
    assert abs(result.restitution - exact.restitution) <= result.restitution_error


def test_json(result):
    plain = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert not set(ARRAY_FIELDS) & set(plain)
    assert plain["restitution"] == result.restitution
    assert plain["error_parts"]["step"] == result.error_parts.step
    broken = dataclasses.replace(result, energy_drift=float("nan"), details={"x": [float("inf")]})
    assert broken.to_dict()["energy_drift"] is None
    assert broken.to_dict()["details"] == {"x": [None]}


def test_arrays(result, tmp_path):
    path = tmp_path / "deep" / "arrays.npz"
    result.save_arrays(path)
    with np.load(path) as file:
        assert sorted(file.files) == sorted(ARRAY_FIELDS)
        assert np.array_equal(file["velocities"], result.velocities)
    assert [p.name for p in path.parent.iterdir()] == ["arrays.npz"], "nothing left aside"


def test_a_result_is_frozen(result):
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.restitution = 1.0


def test_the_file_holds_the_arrays_and_nothing_else(result, tmp_path, monkeypatch):
    # The stand-in acts like NumPy before 2.1, which saves every keyword argument as an array.
    asked = {}
    monkeypatch.setattr(np, "savez_compressed", lambda _file, **arrays: asked.update(arrays))
    result.save_arrays(tmp_path / "a.npz")
    assert set(asked) == set(ARRAY_FIELDS)
