"""Test the list of observables, and the outputs that are generated from this list."""

import dataclasses
import re
import sqlite3
from pathlib import Path

import numpy as np
import pytest

from chaincor.analysis.error_bar import ErrorBar
from chaincor.analysis.observables import (
    OBSERVABLES,
    OF_RUNS,
    OTHER_WORDS,
    TERMS,
    Observed,
    rows_of,
)
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.result import Collision
from chaincor.workflows.store.query import query_rows
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.schema import PLAIN_COLUMNS

UNITS = {"", "length", "time", "speed", "mass", "energy", "s"}
KINDS = {
    "float": float,
    "int": int,
    "bool": bool,
    "str": str,
    "ndarray": np.ndarray,
    "tuple": tuple,
    "dict": dict,
    "ErrorBar": ErrorBar,
}
SCENES = [
    Scene(potential="harmonic", particles=4, engine="reference"),
    Scene(particles=6, target_particles=3, velocity=0.05, engine="reference"),
    Scene(particles=4, masses=(1, 2), contact="power", velocity=0.02, engine="reference"),
]


@pytest.fixture(scope="module", params=SCENES, ids=["wall", "target", "soft"])
def result(request):
    return collide(request.param)


@pytest.mark.parametrize("each", OBSERVABLES.values(), ids=OBSERVABLES)
def test_every_observable_is_defined_and_can_be_computed(each):
    assert re.fullmatch(r"\S.*[^.\s]", each.definition)
    assert each.unit in UNITS
    assert each.run is not None or each.dump is not None
    for row in each.rows:
        assert set(row.also) <= set(OBSERVABLES)


def test_lines_and_words_are_distinguished():
    labels = [row.label for each in OBSERVABLES.values() for row in each.rows]
    words = [word for each in OBSERVABLES.values() for row in each.rows for word in row.words]
    assert len(set(labels)) == len(labels)
    assert len(set(words)) == len(words) == len(OTHER_WORDS)
    assert set(TERMS) <= set(labels)


def test_values_have_the_type_that_is_declared(result):
    for each in OF_RUNS:
        value = getattr(result, each.name)
        if value is None:
            assert each.dtype.endswith(" or None"), each.name
            continue
        assert type(value) is KINDS[each.kind], each.name
        if each.is_array:
            sizes = {
                "(n,)": result.particles,
                "(M,)": result.target_particles,
                "(contacts,)": result.contacts,
            }
            assert value.shape == (sizes[each.shape],), each.name


def test_attributes_json_arrays_and_columns_are_those_of_the_list(result, tmp_path):
    names = {each.name for each in OF_RUNS}
    assert {f.name for f in dataclasses.fields(Observed)} == names
    assert {f.name for f in dataclasses.fields(Collision)} == names | {"replay"}
    usual = {each.name for each in OF_RUNS if not each.rare and not each.is_array}
    assert usual <= set(result.to_dict()) <= names
    assert set(result.arrays()) <= {each.name for each in OF_RUNS if each.is_array}
    scalars = {each.name for each in OF_RUNS if each.kind in ("int", "float", "bool", "str")}
    # The contact's constants are given only for soft bodies.
    assert scalars - {"contact"} <= set(PLAIN_COLUMNS)
    path = tmp_path / "s.db"
    collide([result.scene], store=path, workers=1, progress=False)
    kept = ("restitution", "contacts", "bond_error", "energy_drift", "velocity_after")
    with Store(path, read_only=True) as store:
        (row,) = query_rows(store, kept)
    assert row == tuple(getattr(result, name) for name in kept)


def test_a_store_of_an_older_version_is_read(tmp_path):
    # These results, for a wall and for a free target, were stored before results were generated
    # from the list.
    text = (Path(__file__).parent / "store_of_november_2026.sql").read_text()
    path = tmp_path / "old.db"
    with sqlite3.connect(path) as connection:
        connection.executescript(text)
    connection.close()
    with Store(path, read_only=True) as store:
        columns = ("restitution", "contacts", "bond_error", "velocity_after", "bond_range_source")
        assert query_rows(store, columns, order=["particles"]) == [
            (0.6069417639048875, 4, 0.004488891184710759, None, "every step"),
            (0.33020616939297687, 3, 0.001866315594570419, -0.02375607193236418, "every step"),
        ]
        assert query_rows(store, ["particles"], where=["bond_range_source=every step"])
        result = store.get(SCENES[1])
    assert result is not None
    assert result.result is not None
    assert set(result.result) - {"versions"} <= set(OBSERVABLES)
    assert result.result["restitution"] == 0.33020616939297687


def test_lammps_tells_the_number_of_the_reference_engine():
    found = collide(Scene(particles=3, tolerance=1e-6))
    exact = collide(Scene(particles=3, tolerance=1e-10, engine="reference"))
    plain = found.to_dict()
    # The reference run has the smaller error bar.
    off = abs(plain["reference_restitution"] - exact.restitution)
    assert off <= plain["reference_error"] + exact.restitution_error
    assert 0.0 < plain["reference_error"] < found.restitution_error
    assert "reference_restitution" not in exact.to_dict()
    bare = collide(Scene(particles=3, scheme="verlet", timestep=0.01))
    assert bare.reference_restitution is None


def test_an_end_is_proved_for_the_run_alone_where_the_tolerance_is_missed(result):
    missed = dataclasses.replace(result, ending="proved", tolerance_met=False)
    assert dict(rows_of(missed))["end"].startswith("proved for this run: ")
    met = dataclasses.replace(missed, tolerance_met=True)
    assert dict(rows_of(met))["end"].startswith("proved: ")


def test_the_row_before_the_closing_lines_is_the_number_of_the_reference_engine(result):
    assert "reference engine" not in dict(rows_of(result))
    both = dataclasses.replace(result, reference_restitution=0.58046093, reference_error=1.6e-7)
    label, text = rows_of(both)[-1]
    assert label == "reference engine"
    assert text.startswith("eta = 0.58046093 +- 1.6e-07")


def test_the_bar_of_the_stock_wall_is_called_statistical(result):
    stock = dataclasses.replace(result, wall="reflect", restitution_error=1e-3)
    assert dict(rows_of(stock))["restitution (energy)"].endswith(", statistical bar, 99.5 %")
    # Only the error bar of the stock wall is statistical.
    for other in ({"restitution_error": None}, {"wall": "event"}):
        assert "statistical" not in rows_of(dataclasses.replace(stock, **other))[0][1]


def test_numbers_of_contacts_that_disagree_become_a_range(result):
    assert result.contacts_range is None
    torn = dataclasses.replace(result, contacts=7, contacts_range=(5, 7))
    last = "the last at t = " if result.contact is None else "the last begins at t = "
    assert dict(rows_of(torn))["contacts"].startswith(f"5 to 7, {last}")
    assert f"5 to 7 contacts, {last}" in repr(torn)


def test_the_time_of_the_last_contact_has_a_bar():
    found = collide(Scene(particles=5, tolerance=1e-5, engine="reference"))
    exact = collide(Scene(particles=5, tolerance=1e-10, engine="reference"))
    off = abs(found.last_contact_time - exact.last_contact_time)
    assert 0.0 < off <= found.last_contact_error + exact.last_contact_error
    assert found.to_dict()["last_contact_error"] == found.last_contact_error
    # Without error estimate, there is no second run to compare with.
    alone = collide(Scene(particles=3, scheme="verlet", timestep=0.01, error=False))
    assert alone.last_contact_error is None


def test_runs_that_differ_in_contacts_give_their_range():
    # The run at step 0.4 has a contact that the run at half the step does not have.
    found = collide(Scene(particles=50, scheme="verlet", timestep=0.4, engine="reference"))
    exact = collide(Scene(particles=50, tolerance=1e-6, engine="reference"))
    low, high = found.contacts_range
    assert low <= exact.contacts < found.contacts <= high
    assert found.last_contact_error is None
    assert exact.contacts_range is None
