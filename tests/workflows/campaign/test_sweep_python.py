"""Test that sweeps from Python give one row for each point, in order."""

import sys

import numpy as np
import pytest

from chaincor.lammps_inputs.errors import InputError, SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.sweep import sweep
from chaincor.workflows.collision import collide
from chaincor.workflows.errors import StoreError, SweepError

BASE = Scene(particles=4, engine="reference", tolerance=1e-5)


def test_a_row_for_each_point_in_order(tmp_path):
    store = tmp_path / "kept.sqlite"
    frame = sweep(BASE, store=store, workers=1, speed=np.array([0.3, 0.1]), particles=range(3, 5))
    assert list(frame.columns[:2]) == ["speed", "particles"]
    assert frame["speed"].tolist() == [0.3, 0.3, 0.1, 0.1]
    assert frame["particles"].tolist() == [3, 4, 3, 4]
    assert frame.columns.is_unique
    for _, row in frame.iterrows():
        one = collide(BASE.replace(speed=row["speed"], particles=row["particles"]))
        assert row["restitution"] == one.restitution
    # The second sweep finds all results in the store.
    again = sweep(BASE, store=store, workers=1, speed=[0.1], particles=[4])
    assert again["finished"].tolist() == frame["finished"].tolist()[-1:]


@pytest.mark.slow
def test_an_axis_of_tables_or_of_a_parameter_shows_what_it_sets(store):
    tables = [{"particles": 3}, {"particles": 4, "speed": 0.1}]
    frame = sweep(BASE, store=store, workers=1, chain=tables)
    assert frame.columns[:2].tolist() == ["particles", "speed"]
    assert frame["particles"].tolist() == [3, 4]
    morse = Scene(
        potential="formula",
        energy="D*(1-exp(-a*s))^2",
        parameters={"D": 0.0139, "a": 6.0},
        particles=3,
        velocity=0.05,
        engine="reference",
        tolerance=1e-4,
    )
    frame = sweep(morse, store=store, workers=1, **{"parameters.a": [5.0, 6.0]})
    assert frame["parameters.a"].tolist() == [5.0, 6.0]


@pytest.mark.slow
def test_a_collision_that_fails_is_a_row_that_says_why():
    # At the second speed, particles of the harmonic chain cross in LAMMPS.
    frame = sweep(
        Scene(potential="harmonic", particles=5), workers=1, velocity=[0.1, 2.0], masses=[[1, 2]]
    )
    assert frame["masses"].tolist() == [(1.0, 2.0), (1.0, 2.0)]
    assert np.isfinite(frame["restitution"][0])
    assert np.isnan(frame["restitution"][1])
    assert frame["failure"][1] == "CrossingError"


@pytest.mark.parametrize(
    ("scene", "axes", "error", "message"),
    [
        ({}, {"speed": [0.1]}, InputError, "type dict was given"),
        (BASE, {"sped": [0.1]}, SweepError, "axis 'sped' is not a field of a scene"),
        (BASE, {"speed": 0.1}, SweepError, r"Give a list of values: speed=\[0.1\]"),
        (BASE, {"potential": "lj"}, SweepError, r"Give a list of values: potential=\['lj'\]"),
        (BASE, {"speed": []}, SweepError, "axis 'speed' is"),
        # Python writes no number of more than 4300 digits.
        (BASE, {"speed": 10**5000}, SweepError, "axis 'speed' is an object of type int"),
        (BASE, {"speed": [10**5000]}, SceneError, "speed = an object of type int"),
        (BASE, {"speed": [0.1, -1.0]}, SceneError, "speed is -1.0"),
        (BASE, {"arrays": ["a.npz"]}, SweepError, "'arrays' in a sweep would write"),
        (BASE, {"arrays": "a.npz"}, SweepError, "'arrays' in a sweep would write"),
        (BASE, {"x": [{"dump": "a"}]}, SweepError, "'dump' in a sweep would write"),
        (BASE, {"x": [{"speed": 0.1}], "speed": [0.2]}, SweepError, "'x' and 'speed' both set"),
    ],
)
def test_what_is_no_sweep_is_refused_in_one_line(scene, axes, error, message):
    with pytest.raises(error, match=message) as refused:
        sweep(scene, **axes)
    assert "\n" not in str(refused.value)


def test_without_pandas_the_remedy_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(StoreError, match="pip install pandas"):
        sweep(BASE, speed=[0.1])


def test_a_short_sweep_of_the_reference_engine_starts_no_process():
    resource = pytest.importorskip("resource", reason="needs a POSIX system")

    def seconds_of_processes() -> float:
        return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime

    before = seconds_of_processes()
    frame = sweep(Scene(particles=3, engine="reference"), speed=[0.1, 0.2], workers=2)
    assert len(frame) == 2
    assert seconds_of_processes() == before
