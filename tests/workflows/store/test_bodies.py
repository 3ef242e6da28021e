"""Test masses, targets and contacts in old and new stores."""

import contextlib
import dataclasses
import json
import sqlite3

import numpy as np
import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.export import export_store, to_pandas
from chaincor.workflows.store.merge import merge_stores
from chaincor.workflows.store.query import query_rows
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.row import Row

CHAIN = {"potential": "harmonic", "velocity": 0.1, "particles": 4}
TARGET = Scene(**CHAIN, masses=[1, 2], target_particles=3, target_masses=[5, 1], contact="power")


@pytest.fixture
def collision(make_collision):
    """Return a function that makes a result with the fields of a free target."""

    def make(scene, restitution=0.5):
        made = make_collision(scene, restitution)
        if scene.target_particles is None:
            return made
        return dataclasses.replace(
            made,
            masses=scene.masses,
            target_particles=scene.target_particles,
            target_masses=scene.target_masses,
            velocity_after=0.02,
            target_velocity_after=-0.03,
            translational_energy=0.1,
            vibrational_energy=0.2,
            target_translational_energy=0.3,
            target_vibrational_energy=0.4,
            target_velocities=np.full(scene.target_particles, -0.03),
            target_displacements=np.zeros(scene.target_particles),
            target_mode_energies=np.arange(float(scene.target_particles)),
        )

    return make


@pytest.fixture
def attempt(collision):
    """Return a function that makes a scene and its row."""
    return lambda scene, *given: (scene, Row.of(collision(scene, *given)))


def test_a_result_comes_back_as_it_was(store, collision):
    made = collision(TARGET)
    store.record([(TARGET, Row.of(made))], arrays=True)
    row = store.get(TARGET, arrays=True)
    assert row.result == json.loads(json.dumps(made.to_dict()))
    assert row.result["target_velocity_after"] == -0.03
    for name, array in made.arrays().items():
        assert np.array_equal(row.arrays[name], array)
    assert "target_mode_energies" in row.arrays


def test_a_plain_result_has_no_word_of_bodies(store, attempt):
    scene = Scene(**CHAIN)
    store.record([attempt(scene)], arrays=True)
    row = store.get(scene, arrays=True)
    assert not {name for name in row.result if "target" in name or "masses" in name}
    assert not {name for name in row.arrays if "target" in name}


def test_bodies_are_columns(store, attempt, tmp_path):
    pytest.importorskip("pandas")
    store.record([attempt(TARGET), attempt(Scene(**CHAIN))])
    names = ["masses", "target_particles", "contact_exponent", "target_velocity_after"]
    rows = query_rows(store, names, order=["-target_particles"])
    assert rows == [("[1.0,2.0]", 3, 1.5, -0.03), (None, None, None, None)]
    assert query_rows(store, ["particles"], where=["target_particles=3"]) == [(4,)]
    assert query_rows(store, ["particles"], where=["contact_stiffness="]) == [(4,)]
    frame = to_pandas(store)
    assert frame["target_particles"].dropna().to_list() == [3]
    assert frame["vibrational_energy"].dropna().to_list() == [0.2]
    export_store(store, tmp_path / "all.csv")
    header, *lines = (tmp_path / "all.csv").read_text().splitlines()
    assert "target_masses" in header.split(",")
    assert '"[5.0,1.0]"' in "".join(lines)


def test_one_mass_of_a_list_that_repeats(store, attempt):
    scenes = [
        Scene(**CHAIN),
        Scene(**CHAIN, masses=[1, 2]),
        Scene(**CHAIN, masses=[3, 4, 5]),
        Scene(**CHAIN, masses=[7, 7], target_particles=1),
    ]
    store.record([attempt(scene, 0.1 * (k + 1)) for k, scene in enumerate(scenes)])
    columns = [f"masses.{k}" for k in range(1, 6)] + ["target_masses.1", "target_masses.2"]
    assert query_rows(store, columns, order=["restitution"]) == [
        (1.0, 1.0, 1.0, 1.0, None, None, None),
        (1.0, 2.0, 1.0, 2.0, None, None, None),
        (3.0, 4.0, 5.0, 3.0, None, None, None),
        (7.0, 7.0, 7.0, 7.0, None, 1.0, None),
    ]
    assert query_rows(store, ["restitution"], where=["masses.2>3", "masses.2<5"]) == [
        (pytest.approx(0.3),)
    ]
    for wrong in ("masses.0", "masses.", "masses.1.2", "particles.1", "masses.123456789", "m.1"):
        with pytest.raises(StoreError, match=r"no column|cannot be read"):
            query_rows(store, ["particles"], where=[f"{wrong}>1"])


def test_masses_known_by_their_hash_tell_no_mass(store, attempt):
    scene = Scene(potential="harmonic", velocity=0.1, masses=[1.0] * 99 + [2.0])
    store.record([attempt(scene)])
    assert query_rows(store, ["masses.100"]) == [(None,)]
    assert len(query_rows(store, ["masses"])[0][0]) == 64


def test_merging_keeps_both_bodies(tmp_path, attempt):
    with Store(tmp_path / "a.sqlite") as part:
        part.record([attempt(TARGET)], arrays=True)
    merge_stores(tmp_path / "all.sqlite", [tmp_path / "a.sqlite"])
    with Store(tmp_path / "all.sqlite", read_only=True) as store:
        row = store.get(TARGET, arrays=True)
        assert row.arrays["target_velocities"].tolist() == [-0.03] * 3
        assert query_rows(store, ["target_vibrational_energy"]) == [(0.4,)]


def test_stores_need_no_new_schema(tmp_path, attempt):
    with Store(tmp_path / "a.sqlite") as store:
        store.record([attempt(TARGET)])
    with contextlib.closing(sqlite3.connect(tmp_path / "a.sqlite")) as connection:
        (version,) = connection.execute("PRAGMA user_version").fetchone()
    assert version == 2
