"""Test that a Dask cluster gives the results of local processes, and ends clearly."""

import json
import pickle
import signal
import subprocess
import sys
import threading
from types import SimpleNamespace

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.cluster import DaskCluster
from chaincor.workflows.campaign.into_store import IntoStore, collide_into_store
from chaincor.workflows.errors import SchedulerError, StoreError
from chaincor.workflows.store.results_store import Store
from tests.dask_cluster import dask_cluster
from tests.waiting import HANGS, wait_until
from tests.workflows.campaign.kills import read_rows

pytest.importorskip("distributed")

LONG_SWEEP = (
    '[scene]\nengine = "reference"\npotential = "lj"\nspeed = 0.3\ntolerance = 1e-8\n'
    "[axes]\nparticles = { from = 300, to = 2000, step = 1 }\n"
)
SCENES = [
    *(Scene(potential=p, particles=n, speed=0.3) for p in ("lj", "toda", "log") for n in (5, 12)),
    Scene(potential="harmonic", particles=8, engine="reference"),
    # fails by a named error, because particles cross
    Scene(potential="harmonic", particles=5, velocity=0.9),
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
    """Leave out computing times, which depend on the machine."""
    if not isinstance(value, dict):
        return value
    return {
        k: _without_seconds(v) for k, v in value.items() if k not in ("seconds", "seconds_total")
    }


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch):
    monkeypatch.setattr("chaincor.workflows.campaign.cluster._CONNECT_SECONDS", 1.0)
    with pytest.raises(SchedulerError, match=r"tcp://127.0.0.1:1 .*dask scheduler"):
        DaskCluster("tcp://127.0.0.1:1")


@pytest.mark.parametrize("address", ["http://127.0.0.1:8786", "tcp://127.0.0.1", "127.0.0.1:8786"])
def test_an_address_of_another_form_is_named(chaincor, tmp_path, address):
    (tmp_path / "sweep.toml").write_text("[axes]\nparticles = [2]\n")
    store = tmp_path / "s.sqlite"
    status, out, err = chaincor(
        "sweep", tmp_path / "sweep.toml", "--store", store, "--scheduler", address
    )
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert f"the address of the scheduler is '{address}'" in err


@pytest.mark.slow
def test_a_scheduler_that_needs_certificates_is_reported_in_one_line(tmp_path):
    (tmp_path / "sweep.toml").write_text("[axes]\nparticles = [2]\n")
    command = [sys.executable, "-m", "chaincor", "sweep", "sweep.toml"]
    command += ["--scheduler", "tls://127.0.0.1:8786"]
    # The cluster has its own process, because Dask objects print errors when the process ends.
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr.count("\n")) == (1, "", 1)
    assert "Dask has no certificates for tls://127.0.0.1:8786. Set " in ended.stderr


@pytest.mark.slow
def test_a_killed_scheduler_is_reported_in_one_line(tmp_path):
    (tmp_path / "sweep.toml").write_text(LONG_SWEEP)
    with dask_cluster(workers=1) as processes:
        sweep = _start_sweep(tmp_path, processes.address)
        wait_until(lambda: _rows_in(tmp_path / "sweep.sqlite") or sweep.poll() is not None)
        processes.scheduler.kill()
        out, err = sweep.communicate(timeout=HANGS)
    (said,) = _without_progress(err.splitlines())
    assert (sweep.returncode, out) == (1, "")
    assert "the connection to the Dask scheduler was lost" in said
    assert _rows_in(tmp_path / "sweep.sqlite") > 0


def _start_sweep(folder, address):
    """Start the command on the sweep file of a folder, with the workers of a scheduler."""
    return subprocess.Popen(
        [sys.executable, "-m", "chaincor", "sweep", "sweep.toml", "--scheduler", address],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def _without_progress(lines):
    """Yield lines, except those that a sweep prints each minute on a busy machine."""
    return (line for line in lines if " % of the work, done" not in line)


def _rows_in(path):
    try:
        with Store(path, read_only=True) as store:
            return len(store)
    except StoreError:  # the store does not exist yet
        return 0


class SlowTask:
    """Finished task of a cluster whose result takes three attempts to fetch."""

    key, status, attempts = "task", "finished", 0

    def __init__(self, value):
        self.value = value

    def add_done_callback(self, callback):
        callback(self)

    def result(self, timeout):
        self.attempts += 1
        if self.attempts < 3:
            raise TimeoutError(f"timed out after {timeout} s")
        return self.value


class SlowClient:
    """Client of a cluster that is too busy to send results in time."""

    status = "running"
    scheduler = SimpleNamespace(address="tcp://here:1")

    def ncores(self):
        return {"worker": 1}

    def run(self, *_, **__):
        return {}

    def submit(self, function, *arguments, **_):
        return SlowTask(function(*arguments))

    def cancel(self, _):
        pass


def test_a_result_that_is_late_is_no_failure():
    with DaskCluster.of(SlowClient()) as cluster:
        assert cluster.submit(abs, -3).result(timeout=HANGS) == 3


def test_a_call_and_its_result_pass_dask_as_bytes():
    # The scheduler would keep the points of finished tasks, and Dask's event loop would take long
    # to unpickle rows.
    sent = []

    def submit(function, *args, pure):
        sent.append((function, args))
        return SimpleNamespace(key="k", add_done_callback=lambda _: None)

    cluster = DaskCluster.__new__(DaskCluster)
    cluster._client = SimpleNamespace(submit=submit)
    cluster._pending, cluster._lock = {}, threading.Lock()
    cluster.submit(sorted, [3, 1, 2], reverse=True)
    ((function, (call,)),) = sent
    assert isinstance(call, bytes)
    assert pickle.loads(function(call)) == [3, 2, 1]


@pytest.mark.slow
def test_a_worker_of_another_version_is_named(monkeypatch):
    monkeypatch.setattr("chaincor.workflows.campaign.cluster.version_of", lambda _: "9.9")
    with (
        dask_cluster(workers=1) as processes,
        pytest.raises(SchedulerError, match=r"runs chaincor [\d.]+, but this sweep runs 9\.9"),
    ):
        DaskCluster(processes.address)


@pytest.mark.slow
def test_a_scheduler_without_workers_is_reported(tmp_path):
    (tmp_path / "sweep.toml").write_text(
        '[scene]\nengine = "reference"\npotential = "harmonic"\nvelocity = 0.1\n'
        "[axes]\nparticles = [2, 3]\n"
    )
    with dask_cluster(workers=0) as processes:
        sweep = _start_sweep(tmp_path, processes.address)
        assert sweep.stderr is not None
        said = sweep.stderr.readline()
        assert "has no workers; waiting. Start one with `dask worker tcp://" in said
        sweep.send_signal(signal.SIGINT)
        out, err = sweep.communicate(timeout=HANGS)
        assert sweep.returncode == 130
        assert "Traceback" not in out + err
        assert "never retrieved" not in err


@pytest.mark.slow
def test_a_sweep_whose_workers_all_left_is_reported(tmp_path):
    (tmp_path / "sweep.toml").write_text(LONG_SWEEP)
    with dask_cluster(workers=1) as processes:
        sweep = _start_sweep(tmp_path, processes.address)
        wait_until(lambda: _rows_in(tmp_path / "sweep.sqlite") or sweep.poll() is not None)
        (nanny,) = processes.workers
        nanny.terminate()
        assert sweep.stderr is not None
        said = next(iter(_without_progress(sweep.stderr)))
        assert "has no workers; waiting. Start one with `dask worker tcp://" in said
        sweep.terminate()
        sweep.communicate(timeout=HANGS)


@pytest.mark.slow
def test_two_sweeps_on_one_store_share_the_work(tmp_path):
    (tmp_path / "sweep.toml").write_text(
        '[scene]\nengine = "lammps"\npotential = "lj"\nspeed = 0.3\ntolerance = 1e-5\n'
        "[axes]\nparticles = { from = 3, to = 42, step = 1 }\n"
    )
    with dask_cluster(workers=2) as processes:
        command = [sys.executable, "-m", "chaincor", "sweep", "sweep.toml", "--json"]
        command += ["--scheduler", processes.address]
        sweeps = [
            subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True)
            for _ in range(2)
        ]
        tallies = [json.loads(sweep.communicate(timeout=HANGS)[0]) for sweep in sweeps]
    assert all(sweep.returncode == 0 for sweep in sweeps)
    assert all(tally["computed"] + tally["found"] == 40 for tally in tallies)
    # Tasks that the two runs started at the same time are computed twice. Without shared results,
    # the sum would be 80.
    assert 40 <= sum(tally["computed"] for tally in tallies) < 80
    local = [*command[:-2], "--store", "local.sqlite", "--workers", "2"]
    subprocess.run(local, cwd=tmp_path, stdout=subprocess.DEVNULL, check=True)
    assert read_rows(tmp_path / "sweep.sqlite") == read_rows(tmp_path / "local.sqlite")
