"""Test the results store: one row per collision, with the smallest error."""

import numpy as np
import pytest

from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.errors import WorkerDiedError
from chaincor.workflows.store.query import query_rows
from chaincor.workflows.store.row import Row, host_name

SCENE = Scene(potential="lj", particles=10, speed=0.4, tolerance=1e-6)


# ---- one row ------------------------------------------------------------------------------------


def test_a_result_comes_back_as_it_was(store):
    scene = Scene(potential="harmonic", particles=5, engine="reference")
    collision = collide(scene)
    store.record([(scene, Row.of(collision))], arrays=True)
    found = store.get(scene, arrays=True)
    assert found.result == collision.to_dict()
    assert found.restitution == collision.restitution
    for name, array in collision.arrays().items():
        np.testing.assert_array_equal(found.arrays[name], array)
    columns = found.columns
    assert (columns["host"], columns["tries"], found.failure) == (host_name(), 1, None)


def test_arrays_are_kept_only_on_request(store, make_attempt):
    store.record([make_attempt(SCENE)])
    assert store.get(SCENE).arrays == {}
    assert store.get(SCENE, arrays=True) is None
    store.record([make_attempt(SCENE)], arrays=True)
    assert "contact_times" in store.get(SCENE, arrays=True).arrays


def test_the_speed_is_kept_as_it_was_given(store, make_attempt):
    # For some bonds, 0.1 v*/v* differs from 0.1 in the last bit, but a heat map needs equal speeds.
    scenes = [Scene(potential=p, speed=s) for p in ("lj", "toda", "log") for s in (0.1, 0.3, 0.7)]
    store.record([make_attempt(scene) for scene in scenes])
    assert {row[0] for row in query_rows(store, ["speed"])} == {0.1, 0.3, 0.7}


def test_a_potential_without_a_name_of_its_own_is_refused(store):
    with pytest.raises(SceneError, match="Python object"):
        store.get(Scene(potential=LennardJones(), particles=5))


def test_a_failed_transaction_writes_no_row_of_its_batch(store, make_attempt):
    good = make_attempt(SCENE)
    bad = (Scene(potential=LennardJones()), good.row)
    with pytest.raises(SceneError):
        store.record([good, bad])
    assert len(store) == 0


# ---- which result stays -------------------------------------------------------------------------


def test_a_tighter_result_supersedes_and_a_looser_one_does_not(store, make_attempt):
    tight, loose = SCENE.replace(tolerance=1e-8), SCENE.replace(tolerance=1e-4)
    store.record([make_attempt(SCENE, 0.51)])
    assert store.get(tight) is None
    assert store.get(loose).restitution == 0.51
    store.record([make_attempt(tight, 0.52)])
    store.record([make_attempt(loose, 0.53)])
    assert [store.get(s).restitution for s in (tight, SCENE, loose)] == [0.52] * 3
    assert len(store) == 1


def test_an_error_bar_below_the_tolerance_answers(store, make_attempt):
    store.record([make_attempt(SCENE, error=1e-9)])
    assert store.get(SCENE.replace(tolerance=1e-8)) is not None
    assert store.get(SCENE.replace(tolerance=1e-10)) is None


def test_a_tolerance_that_was_not_met_is_not_tried_again(store, make_attempt):
    store.record([make_attempt(SCENE, error=1e-3)])
    assert store.get(SCENE) is not None


def test_explicit_numerics_are_rows_of_their_own(store, make_attempt):
    plain = Scene(potential="lj", particles=10, speed=0.4, scheme="verlet", error=False)
    store.record([make_attempt(SCENE), make_attempt(plain)])
    assert len(store) == 2
    assert store.get(plain) is not None
    assert store.get(plain.replace(error=True)) is None, "it has no error bar"


def test_the_first_of_two_equal_results_stays_unless_asked(store, make_attempt):
    store.record([make_attempt(SCENE, 0.51)])
    store.record([make_attempt(SCENE, 0.52)])
    assert store.get(SCENE).restitution == 0.51
    store.record([make_attempt(SCENE, 0.53)], replace=True)
    assert (store.get(SCENE).restitution, store.get(SCENE).columns["tries"]) == (0.53, 2)


def test_arrays_stay_those_of_the_result(store, make_attempt):
    tight = SCENE.replace(tolerance=1e-8)
    store.record([make_attempt(SCENE, 0.51)], arrays=True)
    store.record([make_attempt(tight, 0.52)])  # no arrays are requested
    assert store.get(tight, arrays=True).arrays["contact_times"][1] == 0.52
    store.record([make_attempt(SCENE, 0.53)], arrays=True)
    assert store.get(SCENE, arrays=True).arrays["contact_times"][1] == 0.52


def test_a_failure_is_recorded_but_never_replaces_a_result(store, make_attempt, make_failure):
    tight = SCENE.replace(tolerance=1e-8)
    store.record([make_failure(SCENE)])
    assert store.get(SCENE) is None
    assert store.find(SCENE).failure == make_failure(SCENE).row.failure
    store.record([make_attempt(SCENE, 0.51)])
    assert store.find(SCENE).failure is None
    store.record([make_failure(tight)])
    assert store.get(SCENE).restitution == 0.51
    assert store.find(tight).failure == make_failure(tight).row.failure
    assert store.find(SCENE).columns["tries"] == 3


def test_a_failure_stands_for_the_same_and_tighter_tolerances(store, make_failure):
    store.record([make_failure(SCENE)])
    standing = store.find(SCENE)
    assert standing.would_fail(SCENE)
    assert standing.would_fail(SCENE.replace(tolerance=1e-8))
    assert not standing.would_fail(SCENE.replace(tolerance=1e-4))
    store.record([make_failure(SCENE, WorkerDiedError("killed"))])
    assert not store.find(SCENE).would_fail(SCENE)
