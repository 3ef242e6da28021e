"""Test that faults of the machine give a message of one line and damage no earlier results."""

import os
import re
import resource
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.error_messages import TERMINATED
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.row import Row
from tests.waiting import HANGS, wait_until
from tests.workflows.campaign.kills import read_rows

ROOT = Path(__file__).parents[2]
_MAIN = [sys.executable, "-c", "from chaincor.workflows.cli import main; main()"]
# The run takes a second in LAMMPS, after a short pilot run.
LONG = ("--particles", "100", "--scheme", "verlet", "--timestep", "0.002", "--no-error")
SHORT = ("--particles", "3", "--scheme", "verlet", "--no-error")
SWEEP = """
[scene]
engine = "{engine}"
tolerance = 1e-6
[axes]
particles = [40]
speed = {{ from = 0.01, to = 1.0, points = {points} }}
"""


class Call:
    """A call of the command line as a process, with a temporary folder of its own."""

    def __init__(self, folder, *arguments, path=ROOT, limit=None, temporary=None):
        self.temporary = temporary or folder / "tmp"
        self.temporary.mkdir(exist_ok=True)
        environment = os.environ | {"PYTHONPATH": str(path), "TMPDIR": str(self.temporary)}
        self.process = subprocess.Popen(
            [*_MAIN, *map(str, arguments)],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=limit,
        )

    def wait_until(self, happens):
        """Wait for a condition that must become true while the process runs."""

        def runs():
            assert self.process.poll() is None, self.process.communicate()

        wait_until(happens, runs)

    def end(self):
        """Return exit status, stdout and lines of stderr; check that temporary files are gone."""
        out, err = self.process.communicate(timeout=HANGS)
        assert "Traceback" not in err, err
        assert list(self.temporary.iterdir()) == []
        return self.process.returncode, out, [line for line in err.splitlines() if line]

    def in_lammps(self):
        """Return whether LAMMPS has begun to read its files."""
        return any(self.temporary.glob("chaincor-*/chain.data"))


# These files of earlier runs may be replaced. No other file may be overwritten.
# Beginnings by which earlier outputs are recognised.
DUMP = "ITEM: TIMESTEP\n0\nITEM: ATOMS id v_displacement\n"
ARRAYS = "PK\3\4" + 26 * "\0" + "contact_times.npy"


@pytest.fixture
def good(tmp_path):
    """Return a file in a folder of outputs that a failed run must not spoil."""
    (tmp_path / "out").mkdir()
    path = tmp_path / "out" / "motion"
    path.write_text(DUMP)
    return path


def start_sweep(folder, *options, engine="reference", points=400, **settings):
    (folder / "sweep.toml").write_text(SWEEP.format(engine=engine, points=points))
    return Call(folder, "sweep", "sweep.toml", "--workers", "1", *options, **settings)


# ---- signals ------------------------------------------------------------------------------------


def test_a_run_that_is_terminated(tmp_path, good):
    run = Call(tmp_path, "run", *LONG, "--dump", good)
    run.wait_until(run.in_lammps)
    run.process.send_signal(signal.SIGTERM)
    status, out, (known, last) = run.end()
    assert (status, out, last) == (143, "", f"chaincor: {TERMINATED}")
    assert known.startswith("chaincor: no number yet after ")
    assert good.read_text() == DUMP
    assert list(good.parent.iterdir()) == [good]


@pytest.mark.slow
def test_a_sweep_that_is_terminated(tmp_path):
    store = tmp_path / "sweep.sqlite"
    sweep = start_sweep(tmp_path)
    sweep.wait_until(lambda: len(read_rows(store)) >= 3)
    before = read_rows(store)
    sweep.process.send_signal(signal.SIGTERM)
    status, out, lines = sweep.end()
    assert (status, out) == (143, "")
    assert lines[-1] == f"chaincor: {TERMINATED}"
    assert "finished results are in sweep.sqlite" in lines[-2]
    after = read_rows(store)
    assert {key: after[key] for key in before} == before
    assert len(after) < 400


# ---- folders that go away, disks that are full --------------------------------------------------


@pytest.mark.slow
def test_an_output_folder_removed_during_a_run_is_made_again(tmp_path, good):
    run = Call(tmp_path, "run", *LONG, "--dump", good, "--arrays", good.parent / "a.npz")
    run.wait_until(run.in_lammps)
    shutil.rmtree(good.parent)
    status, _, lines = run.end()
    assert (status, lines) == (0, [])
    assert good.read_text().startswith("ITEM: TIMESTEP")
    assert sorted(p.name for p in good.parent.iterdir()) == ["a.npz", "motion"]


@pytest.mark.slow
def test_an_output_folder_replaced_by_a_file_during_a_run(tmp_path, good):
    run = Call(tmp_path, "run", *LONG, "--dump", good)
    run.wait_until(run.in_lammps)
    shutil.rmtree(good.parent)
    good.parent.write_text("a file")
    status, out, lines = run.end()
    assert (status, out, len(lines)) == (2, "", 1)
    assert "is a file. Give another path" in lines[0]
    assert good.parent.read_text() == "a file"


def test_a_temporary_folder_removed_during_a_run(tmp_path, good):
    run = Call(tmp_path, "run", *LONG, "--dump", good)
    run.wait_until(run.in_lammps)
    shutil.rmtree(next(run.temporary.glob("chaincor-*")))
    status, out, lines = run.end()
    assert (status, out, len(lines)) == (1, "", 1)
    assert good.read_text() == DUMP


@pytest.mark.slow
def test_a_store_removed_during_a_sweep(tmp_path):
    (tmp_path / "folder").mkdir()
    store = tmp_path / "folder" / "s.sqlite"
    sweep = start_sweep(tmp_path, "--store", store)
    sweep.wait_until(lambda: len(read_rows(store)) >= 3)
    # Renaming is immediate, whatever SQLite writes at the time. A folder that is emptied in place
    # may get new files.
    shutil.rmtree(store.parent.rename(tmp_path / "removed"))
    status, out, lines = sweep.end()
    assert (out, len(lines)) == ("", 1)
    assert "s.sqlite" in lines[0]
    # Between two writes, SQLite finds a file that it may not write. Within a write, it gets a disk
    # error.
    named = {2: "StoreError)", 1: "StoreWriteError)"}
    assert lines[0].endswith(named[status])


@pytest.mark.slow
@pytest.mark.parametrize("option", ["--arrays", "--dump", "--save"])
def test_a_full_disk_keeps_the_earlier_result(tmp_path, small_disk, option):
    earlier = small_disk / "earlier"
    content = ARRAYS if option == "--arrays" else DUMP
    earlier.write_text(content)
    (small_disk / "filler").write_bytes(b"x" * 296 * 1024)
    target = small_disk / "job" if option == "--save" else earlier
    status, out, lines = Call(tmp_path, "run", *SHORT, option, target).end()
    assert (status in (1, 2), out, len(lines)) == (True, "", 1)
    assert "No space left on device" in lines[0]
    assert earlier.read_text() == content
    assert sorted(p.name for p in small_disk.iterdir() if p.is_file()) == ["earlier", "filler"]


@pytest.mark.slow
@pytest.mark.parametrize("bond", ["--potential=lj", "--potential=harmonic"])
def test_a_full_temporary_disk(tmp_path, small_disk, good, bond):
    # 40 kB are too small for a bond table and for the dump, which LAMMPS itself writes.
    (small_disk / "filler").write_bytes(b"x" * 260 * 1024)
    scene = (*LONG, "--velocity", "0.05", bond, "--dump", good)
    status, out, lines = Call(tmp_path, "run", *scene, temporary=small_disk / "tmp").end()
    assert (status, out, len(lines)) == (1, "", 1)
    assert "No space left on device" in lines[0]
    assert good.read_text() == DUMP


# ---- memory, and libraries that do not load -----------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("megabytes", "said"),
    # With little memory, start-up fails at different places on different machines.
    [(600, "a library does not load|memory"), (1000, "memory")],
)
def test_a_memory_limit(tmp_path, good, megabytes, said):
    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (megabytes * 2**20,) * 2)

    scene = ("--particles", "10000000", "--engine", "reference", "--scheme", "verlet", "--no-error")
    good.write_text(ARRAYS)
    options = ("--most-hours", "1e9", "--arrays", good)
    status, out, lines = Call(tmp_path, "run", *scene, *options, limit=limit).end()
    assert (status, out, len(lines)) == (1, "", 1)
    assert re.search(said, lines[0])
    assert good.read_text() == ARRAYS


@pytest.mark.slow
@pytest.mark.parametrize("error", ["OSError('libmpi.so.12: no such file')", "ImportError('torn')"])
def test_a_lammps_library_that_does_not_load(tmp_path, good, error):
    broken = tmp_path / "broken"
    (broken / "lammps").mkdir(parents=True)
    (broken / "lammps" / "__init__.py").write_text(f"raise {error}\n")
    path = f"{broken}{os.pathsep}{ROOT}"
    status, out, lines = Call(tmp_path, "run", *SHORT, "--dump", good, path=path).end()
    assert (status, out, len(lines)) == (1, "", 1)
    assert "the LAMMPS library does not load" in lines[0]
    assert lines[0].endswith("MissingLibraryError)")
    assert good.read_text() == DUMP
    if error.startswith("OS"):
        with Store(tmp_path / "sweep.sqlite") as store:
            scene = Scene(particles=3, speed=0.4, engine="reference")
            store.record([(scene, Row.of(collide(scene)))])
        before = read_rows(tmp_path / "sweep.sqlite")
        status, out, lines = start_sweep(tmp_path, engine="lammps", points=3, path=path).end()
        assert (status, out, len(lines)) == (1, "", 1)
        assert lines[0].endswith("MissingLibraryError)")
        assert read_rows(tmp_path / "sweep.sqlite") == before
