"""Test that users' executors give the same results as new processes, and report their failures."""

import multiprocessing
import os
import signal
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor

import pytest

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.sweep import sweep
from chaincor.workflows.collision import collide
from chaincor.workflows.errors import SchedulerError
from chaincor.workflows.store.results_store import Store
from tests.dask_cluster import dask_cluster

# The scenes are batches and single collisions of the reference engine, and collisions by LAMMPS.
SCENES = [
    *(Scene(particles=5, speed=0.02 * k, engine="reference", tolerance=1e-5) for k in range(1, 21)),
    Scene(potential="harmonic", particles=8, engine="reference"),
    *(Scene(potential=p, particles=4, speed=0.3) for p in ("lj", "toda")),
]


@pytest.fixture(scope="module")
def expected():
    return [result.restitution for result in collide(SCENES, workers=1, progress=False)]


def check(executor, expected, tmp_path):
    """Check results with and without a store, and that the executor stays open."""
    found = collide(SCENES, executor=executor, progress=False)
    assert [result.restitution for result in found] == expected
    rows = collide(SCENES, store=tmp_path / "s.sqlite", executor=executor, progress=False)
    assert [row.restitution for row in rows] == expected
    assert executor.submit(abs, -1).result() == 1


def test_threads_give_the_same_results(expected, tmp_path):
    with ThreadPoolExecutor(2) as threads:
        check(threads, expected, tmp_path)


@pytest.mark.slow
def test_processes_give_the_same_results(expected, tmp_path):
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=spawn) as processes:
        check(processes, expected, tmp_path)


@pytest.mark.slow
def test_a_dask_client_gives_the_same_results(expected, tmp_path):
    distributed = pytest.importorskip("distributed")
    with (
        dask_cluster(workers=2) as processes,
        distributed.Client(processes.address, set_as_default=False) as client,
    ):
        check(client, expected, tmp_path)
        base = SCENES[0].without("speed")
        frame = sweep(base, executor=client.get_executor(), progress=False, speed=[0.02, 0.04])
        assert frame["restitution"].tolist() == expected[:2]


@pytest.mark.slow
def test_loky_gives_the_same_results(expected, tmp_path):
    # joblib contains loky.
    loky = pytest.importorskip("joblib.externals.loky")
    executor = loky.get_reusable_executor(max_workers=2)
    check(executor, expected, tmp_path)
    executor.shutdown(kill_workers=True)


@pytest.mark.slow
def test_mpi4py_gives_the_same_results(expected, tmp_path):
    futures = pytest.importorskip("mpi4py.futures")
    with futures.MPIPoolExecutor(2) as executor:
        check(executor, expected, tmp_path)


def test_the_executor_of_a_sweep_computes_it():
    with ThreadPoolExecutor(1) as threads:
        frame = sweep(SCENES[0], executor=threads, workers=1, progress=False, particles=[3, 4])
    alone = collide([SCENES[0].replace(particles=n) for n in (3, 4)], workers=1, progress=False)
    assert frame["restitution"].tolist() == [result.restitution for result in alone]


class Counting(Executor):
    """Executor that runs tasks at once and counts those whose results are not yet fetched."""

    def __init__(self, most):
        self.most, self.asked = most, []

    def submit(self, function, /, *args, **kwargs):
        future = Future()
        self.asked.append(future)
        assert sum(not each.done() for each in self.asked) <= self.most
        future.set_result(function(*args, **kwargs))
        return future


def test_workers_says_how_many_tasks_an_unknown_executor_has(expected):
    executor = Counting(most=6)
    found = collide(SCENES, executor=executor, workers=3, progress=False)
    assert [result.restitution for result in found] == expected
    assert len(executor.asked) > 3


def _die(_scenes, **_options):
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.slow
def test_an_executor_that_lost_its_workers_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("chaincor.workflows.campaign.into_store.collide_to_rows", _die)
    spawn = multiprocessing.get_context("spawn")
    with (
        ProcessPoolExecutor(1, mp_context=spawn) as processes,
        pytest.raises(SchedulerError, match="the executor lost its workers"),
    ):
        collide(SCENES[:2], store=tmp_path / "s.sqlite", executor=processes, progress=False)
    with Store(tmp_path / "s.sqlite") as store:
        assert len(store) == 0


def test_a_closed_executor_and_other_objects_are_named():
    threads = ThreadPoolExecutor(1)
    threads.shutdown()
    with pytest.raises(SchedulerError, match=r"takes no tasks .*Give an open one"):
        collide(SCENES[:2], executor=threads, progress=False)
    with pytest.raises(InputError, match=r"of type str\. Give a concurrent\.futures\.Executor"):
        collide(SCENES[:2], executor="threads", progress=False)
    with pytest.raises(InputError, match="needs several scenes"):
        collide(SCENES[0], executor=threads)
