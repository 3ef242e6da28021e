"""
Kill -9 of every part of a sweep at random moments, and what is left of it.

``python -m tests.workflows.campaign.kills 100`` starts small sweeps again and again and kills the
main process, a worker, the Dask scheduler, a Dask worker, the client of a Dask sweep, or all
processes of a Dask sweep at once. After every kill the store must be sound and hold every row that
could be read before; after a resume it must hold exactly the rows of an undisturbed sweep, to the
last bit of eta. No process of the sweep may be left.
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
from dataclasses import dataclass, field
from pathlib import Path

from tests.dask_cluster import children, dask_cluster, start_quietly

KINDS = ("main", "worker", "scheduler", "dask worker", "dask client", "machine")
SWEEP = """
arrays = true
[scene]
tolerance = 1e-6
[axes]
particles = [5, 10, 20]
speed = {{ from = 0.01, to = 1.0, points = {points}, spacing = "log" }}
potential = ["lj", "toda"]
"""
_MAIN = [sys.executable, "-c", "from chaincor.workflows.cli import main; main()", "sweep"]
_PATIENCE = 600.0

Rows = dict[str, tuple]


@dataclass
class Study:
    """Outcome of many kills."""

    #: How many of each kind found something to kill.
    kills: Counter = field(default_factory=Counter)
    missed: int = 0  #: Sweeps that were over before their kill came.
    recorded_deaths: int = 0  #: Rows that named a dead worker when the sweep went on without it.
    #: Rows in the store when it was killed: shows that the moments are spread.
    rows_at_kill: list[int] = field(default_factory=list)


def study_kills(
    count: int,
    folder: Path,
    *,
    points: int = 20,
    kinds: tuple[str, ...] = KINDS,
    seed: int = 1,
    deadline: float | None = None,
) -> Study:
    """
    Kill parts of sweeps and check what is left.

    A sweep has six collisions for each of `points` speeds; each of `kinds` is killed equally often,
    when the store has a number of rows that is drawn by `seed`. No sweep begins after the
    `deadline`, in seconds since the epoch.
    """
    chance, study = random.Random(seed), Study()
    sweep = folder / "sweep.toml"
    sweep.write_text(SWEEP.format(points=points))
    whole = folder / "undisturbed.sqlite"
    _run(sweep, whole)
    expected = read_rows(whole)
    number = 0
    while sum(study.kills.values()) < count:
        kind = min(kinds, key=study.kills.__getitem__)
        number += 1
        store = folder / f"{number}.sqlite"
        moment = chance.randrange(len(expected))
        in_dask = kind not in ("main", "worker")
        with dask_cluster() if in_dask else contextlib.nullcontext() as cluster:
            _disturb(kind, sweep, store, moment, cluster, study, chance)
        _run(sweep, store)
        after = read_rows(store)
        other = {key: _differences(after.get(key), row) for key, row in expected.items()}
        other = {key: found for key, found in other.items() if found}
        assert not other, f"{kind}: resumed to other rows than an undisturbed sweep: {other}"
        assert len(after) == len(expected)
        store.unlink()
        if deadline is not None and time.time() > deadline:
            break
    return study


def _disturb(kind, sweep, store, moment, cluster, study, chance) -> None:
    options = ["--workers", "2"] if cluster is None else ["--scheduler", cluster.address]
    process = start_quietly([*_MAIN, str(sweep), "--store", str(store), *options])
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
    _wait_for_end(family)
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
        except sqlite3.OperationalError:  # the tables are not there yet
            return 0


def read_rows(path: Path) -> Rows:
    """
    Check a store from outside and read what must not differ between sweeps.

    By key: eta, error bar, contacts, time of the last, the arrays, and the failure's name.
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


def _wait_for_end(pids: list[int]) -> None:
    """Workers must not outlive the main process."""
    deadline = time.monotonic() + 10.0
    while time.monotonic() < deadline:
        alive = [pid for pid in pids if _runs(pid)]
        if not alive:
            return
        time.sleep(0.05)
    raise AssertionError(f"workers {alive} outlived the sweep")


def _runs(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def _run(sweep: Path, store: Path) -> None:
    process = start_quietly([*_MAIN, str(sweep), "--store", str(store), "--workers", "2"])
    status = process.wait(_PATIENCE)
    failures = [row[-1] for row in read_rows(store).values() if row[-1] is not None]
    assert status == 0, f"an undisturbed sweep ended with status {status}; failures: {failures}"


if __name__ == "__main__":
    wanted, seed, minutes, points, *chosen = [
        *sys.argv[1:],
        *("100", "1", "600", "20")[len(sys.argv) - 1 :],
    ]
    with tempfile.TemporaryDirectory(prefix="sweep-kills-") as name:
        result = study_kills(
            int(wanted),
            Path(name),
            points=int(points),
            kinds=tuple(chosen) or KINDS,
            seed=int(seed),
            deadline=time.time() + 60.0 * float(minutes),
        )
    print(dict(result.kills), "killed;", result.missed, "sweeps were over before")
    print("rows there at the kill:", sorted(result.rows_at_kill))
    print("deaths recorded while the sweep went on:", result.recorded_deaths)
    print("every store sound, no row lost, none twice, every resumed sweep equal to the bit")
