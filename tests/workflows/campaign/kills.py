"""
Kill -9 of every part of a sweep at random moments, and what is left of it.

``python -m tests.workflows.campaign.kills 100`` starts small sweeps again and again and kills the
main process, a worker, the Dask scheduler or a Dask worker of each. After every kill the store must
be sound and hold every row that could be read before; after a resume it must hold exactly the rows
of an undisturbed sweep, to the last bit of eta.
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

KINDS = ("main", "worker", "scheduler", "dask worker")
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
_PATIENCE = 120.0

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
    count: int, folder: Path, *, points: int = 20, kinds: tuple[str, ...] = KINDS, seed: int = 1
) -> Study:
    """
    Kill parts of sweeps and check what is left.

    A sweep has six collisions for each of `points` speeds; each of `kinds` is killed equally often,
    at moments drawn by `seed`.
    """
    chance, study = random.Random(seed), Study()
    sweep = folder / "sweep.toml"
    sweep.write_text(SWEEP.format(points=points))
    whole = folder / "undisturbed.sqlite"
    _run(sweep, whole)  # the first may have to compile
    whole.unlink()
    started = time.monotonic()
    _run(sweep, whole)
    usual = time.monotonic() - started
    expected = read_rows(whole)
    number = 0
    while sum(study.kills.values()) < count:
        kind = min(kinds, key=study.kills.__getitem__)
        number += 1
        store = folder / f"{number}.sqlite"
        moment = chance.uniform(0.2, 1.0) * usual
        in_dask = kind in ("scheduler", "dask worker")
        with dask_cluster() if in_dask else contextlib.nullcontext() as cluster:
            _disturb(kind, sweep, store, moment, cluster, study, chance)
        _run(sweep, store)
        after = read_rows(store)
        other = {key: _differences(after.get(key), row) for key, row in expected.items()}
        other = {key: found for key, found in other.items() if found}
        assert not other, f"{kind}: resumed to other rows than an undisturbed sweep: {other}"
        assert len(after) == len(expected)
        store.unlink()
    return study


def _disturb(kind, sweep, store, moment, cluster, study, chance) -> None:
    options = ["--workers", "2"] if cluster is None else ["--scheduler", cluster.address]
    process = start_quietly([*_MAIN, str(sweep), "--store", str(store), *options])
    time.sleep(moment)
    before = read_rows(store)
    victims = {
        "main": lambda: [process.pid],
        "worker": lambda: children(process.pid, "spawn_main"),
        "scheduler": lambda: [cluster.scheduler.pid],
        "dask worker": lambda: [c for w in cluster.workers for c in children(w.pid, "spawn_main")],
    }[kind]()
    family = children(process.pid, "spawn_main")
    if process.poll() is not None or not victims:
        study.missed += 1
    else:
        with contextlib.suppress(ProcessLookupError):
            os.kill(chance.choice(victims), signal.SIGKILL)
        study.kills[kind] += 1
        study.rows_at_kill.append(len(before))
    process.wait(_PATIENCE)
    _wait_for_end(family)
    left = read_rows(store)
    lost = {key for key, row in before.items() if row[0] is not None and left.get(key) != row}
    assert not lost, f"{kind}: {len(lost)} finished rows were lost or changed"
    study.recorded_deaths += sum(row[-1] == "WorkerDiedError" for row in left.values())


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
    wanted = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    with tempfile.TemporaryDirectory(prefix="sweep-kills-") as name:
        result = study_kills(wanted, Path(name), seed=seed)
    print(dict(result.kills), "killed;", result.missed, "sweeps were over before")
    print("rows there at the kill:", sorted(result.rows_at_kill))
    print("deaths recorded while the sweep went on:", result.recorded_deaths)
    print("every store sound, no row lost, none twice, every resumed sweep equal to the bit")
