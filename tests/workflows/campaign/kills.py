"""
Kill every part of a sweep by SIGKILL at random moments, and check its store.

``python -m tests.workflows.campaign.kills 100`` starts short sweeps again and again and kills the
main process, a worker, the Dask scheduler, a Dask worker, the client of a Dask sweep, or all
processes of a Dask sweep at once. After every kill, the store must be intact and contain every row
that could be read before. After a resume, it must contain exactly the rows of an undisturbed local
sweep, to the last bit of eta and of the arrays. No process of the sweep may remain.
"""

import contextlib
import os
import random
import signal
import sqlite3
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tests.dask_cluster import DaskProcesses, children, dask_cluster, start_quietly

LOCAL_KINDS = ("main", "worker")
# The cluster survives these kills and is used for the resume.
CLUSTER_STAYS = ("dask worker", "dask client")
CLUSTER_ENDS = ("scheduler", "machine")
KINDS = (*LOCAL_KINDS, *CLUSTER_STAYS, *CLUSTER_ENDS)
SWEEP = """
arrays = true
[scene]
engine = "{engine}"
tolerance = {tolerance}
[axes]
particles = [3, 5, 8]
speed = {{ from = 0.01, to = 0.5, points = {points}, spacing = "log" }}
potential = ["lj", "toda"]
"""
_MAIN = [sys.executable, "-c", "from chaincor.workflows.cli import main; main()", "sweep"]
_PATIENCE = 1200.0
# Processes inherit this variable from the study, which recognizes them by it.
_MARK = "CHAINCOR_KILL_STUDY"

Rows = dict[str, tuple]


@dataclass
class Study:
    """Outcome of many kills."""

    #: Number of effective kills of each kind.
    kills: Counter = field(default_factory=Counter)
    missed: int = 0  #: Number of sweeps that ended before their kill.
    #: Number of rows with the failure of a dead worker in sweeps that continued.
    recorded_deaths: int = 0
    #: Number of rows in the store at each kill, which shows that the moments are spread.
    rows_at_kill: list[int] = field(default_factory=list)


def study_kills(
    count: int,
    folder: Path,
    *,
    points: int = 20,
    engine: str = "lammps",
    kinds: tuple[str, ...] = KINDS,
    seed: int = 1,
    deadline: float | None = None,
) -> Study:
    """
    Kill parts of sweeps and check their stores.

    A sweep has six collisions for each of `points` speeds. Each of `kinds` is killed equally often,
    when the store has a random number of rows drawn from `seed`. A Dask cluster is used for one
    kill that it survives and one that ends it. No sweep begins after the `deadline`, in seconds
    since the epoch.
    """
    chance, study = random.Random(seed), Study()
    sweep = folder / "sweep.toml"
    tolerance = 1e-6 if engine == "lammps" else 1e-4
    sweep.write_text(SWEEP.format(points=points, engine=engine, tolerance=tolerance))
    whole = folder / "undisturbed.sqlite"
    _run(sweep, whole, ["--workers", "2"])
    expected = read_rows(whole)
    number = 0
    while sum(study.kills.values()) < count and (deadline is None or time.time() < deadline):
        number += 1
        with _marked(f"{os.getpid()}-{number}"), contextlib.ExitStack() as stack:
            cluster = None
            for kind in _next_kinds(study, kinds, count):
                if kind not in LOCAL_KINDS and cluster is None:
                    cluster = stack.enter_context(dask_cluster())
                store = folder / f"{number}-{kind.replace(' ', '-')}.sqlite"
                moment = chance.randrange(len(expected))
                _disturb(kind, sweep, store, moment, cluster, study, chance)
                # A sweep continues without a lost worker, so that nothing is left to resume.
                stays = cluster is not None and kind in CLUSTER_STAYS
                _run(sweep, store, _where(cluster if stays else None))
                _compare(kind, read_rows(store), expected)
                store.unlink()
    return study


def _next_kinds(study: Study, kinds: tuple[str, ...], count: int) -> list[str]:
    """Return the kinds with the fewest kills: one for a local sweep, or up to two for a cluster."""
    least = min(study.kills[kind] for kind in kinds)
    rarest = [kind for kind in kinds if study.kills[kind] == least]
    if local := [kind for kind in rarest if kind in LOCAL_KINDS]:
        return local[:1]
    groups = ([kind for kind in rarest if kind in group] for group in (CLUSTER_STAYS, CLUSTER_ENDS))
    return [group[0] for group in groups if group][: count - sum(study.kills.values())]


@contextlib.contextmanager
def _marked(mark: str) -> Iterator[None]:
    """Mark the processes that begin inside the block; check that none runs after it."""
    os.environ[_MARK] = mark
    try:
        yield
    finally:
        del os.environ[_MARK]
    line = f"{_MARK}={mark}".encode()
    _wait_for_end(
        lambda: [
            int(entry.parent.name)
            for entry in Path("/proc").glob("[0-9]*/environ")
            if _runs(int(entry.parent.name)) and line in _content(entry).split(b"\0")
        ]
    )


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""


def _where(cluster: DaskProcesses | None) -> list[str]:
    """Return the options that choose where a sweep runs."""
    return ["--workers", "2"] if cluster is None else ["--scheduler", cluster.address]


def _compare(kind: str, found: Rows, expected: Rows) -> None:
    other = {key: _differences(found.get(key), row) for key, row in expected.items()}
    other = {key: differences for key, differences in other.items() if differences}
    assert not other, f"{kind}: resumed to other rows than an undisturbed sweep: {other}"
    assert len(found) == len(expected)


def _disturb(kind, sweep, store, moment, cluster, study, chance) -> None:
    process = start_quietly([*_MAIN, str(sweep), "--store", str(store), *_where(cluster)])
    while _number_of_rows(store) < moment and process.poll() is None:
        time.sleep(0.05)
    before = read_rows(store)
    dask_workers = [] if cluster is None else _workers_of(cluster)
    choice = {
        "main": [process.pid],
        "dask client": [process.pid],
        "worker": children(process.pid, "spawn_main"),
        "scheduler": [] if cluster is None else [cluster.scheduler.pid],
        "dask worker": dask_workers,
    }
    if kind == "machine":
        nannies = [each.pid for each in cluster.workers]
        victims = [process.pid, cluster.scheduler.pid, *nannies, *dask_workers]
    else:
        victims = [chance.choice(choice[kind])] if choice[kind] else []
    family = children(process.pid, "spawn_main")
    if process.poll() is not None or not victims:
        study.missed += 1
    else:
        for victim in victims:
            with contextlib.suppress(ProcessLookupError):
                os.kill(victim, signal.SIGKILL)
        study.kills[kind] += 1
        print(f"{kind}: killed with {len(before)} rows in the store", flush=True)
        study.rows_at_kill.append(len(before))
    process.wait(_PATIENCE)
    _wait_for_end(lambda: [pid for pid in family if _runs(pid)])
    left = read_rows(store)
    lost = {key for key, row in before.items() if row[0] is not None and left.get(key) != row}
    assert not lost, f"{kind}: {len(lost)} finished rows were lost or changed"
    study.recorded_deaths += sum(row[-1] == "WorkerDiedError" for row in left.values())


def _workers_of(cluster) -> list[int]:
    """Return the processes of the Dask workers, without their nannies."""
    return [pid for worker in cluster.workers for pid in children(worker.pid, "spawn_main")]


def _number_of_rows(store: Path) -> int:
    if not store.exists():
        return 0
    with contextlib.closing(sqlite3.connect(store, timeout=30.0)) as connection:
        try:
            return connection.execute("SELECT count(*) FROM collisions").fetchone()[0]
        except sqlite3.OperationalError:  # the tables do not exist yet
            return 0


def read_rows(path: Path) -> Rows:
    """
    Check a store by SQLite and read the results that must not differ between sweeps.

    Each key has eta, error bar, number of contacts, time of the last contact, arrays, and name of
    the failure.
    """
    if not path.exists():
        return {}
    with contextlib.closing(sqlite3.connect(path, timeout=30.0)) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        if connection.execute("PRAGMA user_version").fetchone() == (0,):
            return {}
        rows = connection.execute(
            "SELECT collision_sha256, restitution, restitution_error, contacts, last_contact_time, "
            "(SELECT group_concat(hex(npy)) FROM arrays AS a "
            "WHERE a.collision_sha256 = c.collision_sha256), failure FROM collisions AS c"
        ).fetchall()
    assert len({row[0] for row in rows}) == len(rows), "a row is there twice"
    return {row[0]: row[1:] for row in rows}


def _differences(row: tuple | None, expected: tuple) -> list[tuple]:
    """Return the fields in which two rows differ, cut to a readable length."""
    if row is None:
        return [("missing",)]
    pairs = enumerate(zip(row, expected, strict=True))
    return [(n, str(x)[:300], str(y)[:300]) for n, (x, y) in pairs if x != y]


def _wait_for_end(still_running: Callable[[], list[int]]) -> None:
    """Wait until all processes of a sweep have ended."""
    deadline = time.monotonic() + 60.0
    while alive := still_running():
        assert time.monotonic() < deadline, f"processes {alive} outlived the sweep"
        time.sleep(0.05)


def _runs(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def _run(sweep: Path, store: Path, where: list[str]) -> None:
    process = start_quietly([*_MAIN, str(sweep), "--store", str(store), *where])
    status = process.wait(_PATIENCE)
    failures = [row[-1] for row in read_rows(store).values() if row[-1] is not None]
    assert status == 0, f"an undisturbed sweep ended with status {status}; failures: {failures}"


if __name__ == "__main__":
    wanted, seed, minutes, points, engine, *chosen = [
        *sys.argv[1:],
        *("100", "1", "600", "20", "lammps")[len(sys.argv) - 1 :],
    ]
    with tempfile.TemporaryDirectory(prefix="sweep-kills-") as name:
        result = study_kills(
            int(wanted),
            Path(name),
            points=int(points),
            engine=engine,
            kinds=tuple(chosen) or KINDS,
            seed=int(seed),
            deadline=time.time() + 60.0 * float(minutes),
        )
    print(dict(result.kills), "killed;", result.missed, "sweeps were over before")
    print("rows there at the kill:", sorted(result.rows_at_kill))
    print("deaths recorded while the sweep went on:", result.recorded_deaths)
    print("every store sound, no row lost, none twice, every resumed sweep equal to the bit")
