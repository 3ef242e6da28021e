"""A Dask cluster: the same results as the processes of one machine, and clear ends."""

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.cluster import DaskCluster
from chaincor.workflows.campaign.into_store import IntoStore, collide_into_store
from chaincor.workflows.errors import SchedulerError
from chaincor.workflows.store.results_store import Store
from tests.dask_cluster import dask_cluster

pytest.importorskip("distributed")

SCENES = [
    *(Scene(potential=p, particles=n, speed=0.3) for p in ("lj", "toda", "log") for n in (5, 12)),
    Scene(potential="harmonic", particles=8, engine="reference"),
    Scene(potential="harmonic", particles=5, velocity=0.9),  # fails by name: particles cross
]


@pytest.mark.slow
def test_results_are_those_of_the_local_pool_to_the_last_bit(tmp_path):
    local = collide_into_store(SCENES, tmp_path / "local.sqlite", workers=2, arrays=True)
    with (
        dask_cluster(workers=2) as processes,
        Store(tmp_path / "dask.sqlite") as store,
        DaskCluster(processes.address) as cluster,
    ):
        into = IntoStore(store, SCENES, arrays=True)
        summary = into.run(cluster, in_flight=cluster.in_flight)
        remote = [store.find(scene, arrays=True) for scene in SCENES]
    assert (summary.computed, summary.failed) == (len(SCENES) - 1, 1)
    for here, there in zip(local, remote, strict=True):
        assert _timeless(here) == _timeless(there)


def _timeless(row):
    arrays = {name: array.tobytes() for name, array in row.arrays.items()}
    return row.scene, _without_seconds(row.result), row.failure, row.columns["tries"], arrays


def _without_seconds(value):
    """Leave out what depends on the machine's mood, not on the collision."""
    if not isinstance(value, dict):
        return value
    return {
        k: _without_seconds(v) for k, v in value.items() if k not in ("seconds", "seconds_total")
    }


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch):
    monkeypatch.setattr("chaincor.workflows.campaign.cluster._CONNECT_SECONDS", 1.0)
    with pytest.raises(SchedulerError, match=r"tcp://127.0.0.1:1 .*dask scheduler"):
        DaskCluster("tcp://127.0.0.1:1")
