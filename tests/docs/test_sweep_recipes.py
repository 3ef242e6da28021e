"""Run the recipes on the page on sweeps, with a stand-in for Slurm."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from chaincor.workflows.store.query import query_rows
from chaincor.workflows.store.store_set import open_stores
from tests.docs.documents import _environment

PAGE = (Path(__file__).parents[2] / "docs" / "sweeps.md").read_text(encoding="utf-8")
SWEEP = """
[scene]
engine = "reference"
tolerance = 1e-4
[axes]
particles = [2, 3]
speed = { from = 0.05, to = 0.5, points = 12 }
"""
COLUMNS = ("collision_sha256", "restitution", "restitution_error", "contacts", "scene")

pytestmark = pytest.mark.slow


def recipe(name):
    """Return the block of the page whose first line names this file."""
    blocks = re.findall(r"^```[^\n]*\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    (found,) = (block for block in blocks if f"# {name}\n" in block)
    return found


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Return a folder with the sweep and its local results; put the program on the path."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "commands").mkdir()
    for name, value in _environment(tmp_path / "commands").items():
        monkeypatch.setenv(name, value)
    (tmp_path / "speeds.toml").write_text(SWEEP)
    run("chaincor", "sweep", "speeds.toml", "--store", "local.sqlite", "--workers", "1")
    return tmp_path


def run(*command, **environment):
    subprocess.run(command, check=True, env=os.environ | environment, stdout=subprocess.DEVNULL)


def rows(*paths):
    with open_stores([Path(path) for path in paths]) as stores:
        return query_rows(stores, COLUMNS, order=["collision_sha256"])


def fake(folder, name, text):
    """Put a stand-in for a program on the path."""
    file = folder / "commands" / name
    file.write_text(f"#!/bin/bash\n{text}")
    file.chmod(0o755)


def test_a_job_array_writes_shards(here):
    script = recipe("shards.slurm")
    array = re.search(r"#SBATCH --array=1-(\d+)%(\d+)\n", script)
    assert array[1] in re.search(r"--shard \"\$SLURM_ARRAY_TASK_ID/(\d+)\"", script)[1]
    # A hundred tasks would start a hundred processes; eight are enough for the test.
    (here / "shards.slurm").write_text(script.replace('ID/100"', 'ID/8"'))
    for number in range(1, 9):
        task = {"SLURM_ARRAY_TASK_ID": str(number), "SLURM_CPUS_PER_TASK": "1"}
        run("bash", "shards.slurm", **task)
    assert len(list((here / "speeds.shards").iterdir())) == 8
    assert rows("speeds.shards") == rows("local.sqlite")
    run("chaincor", "store", "merge", "all.sqlite", "speeds.shards")
    assert rows("all.sqlite") == rows("local.sqlite")


def test_snakemake_computes_the_shards(here):
    pytest.importorskip("snakemake")
    (here / "Snakefile").write_text(recipe("Snakefile"))
    run(sys.executable, "-m", "snakemake", "--cores", "2")
    assert rows("speeds.shards") == rows("local.sqlite")


def test_signac_has_a_job_for_each_shard(here):
    pytest.importorskip("signac")
    (here / "shards.py").write_text(recipe("shards.py"))
    run(sys.executable, "shards.py")
    assert rows(*here.glob("workspace/*/part.sqlite")) == rows("local.sqlite")


def test_dask_jobqueue_starts_workers_by_sbatch(here):
    pytest.importorskip("dask_jobqueue")
    # Like sbatch, the stand-in runs a copy of the script.
    submit = 'cp "$1" job.$$\nsetsid bash job.$$ > worker.log 2>&1 &\n'
    fake(here, "sbatch", submit + 'echo "Submitted batch job $!"\n')
    fake(here, "scancel", 'for job in "$@"; do kill -- "-$job"; done 2> /dev/null; true\n')
    fake(here, "squeue", "true\n")
    script = recipe("cluster.py").replace("=8", "=2").replace("=16", "=1")
    (here / "cluster.py").write_text(script)
    run(sys.executable, "cluster.py")
    assert rows("speeds.sqlite") == rows("local.sqlite")
    jobs = [file.read_text() for file in here.glob("job.*")]
    assert jobs
    assert all("--nthreads 1 " in job and "--nworkers 2 " in job for job in jobs)


def test_the_recipes_name_their_programs():
    assert shutil.which("bash")
    for name in ("shards.slurm", "Snakefile", "shards.py", "cluster.py"):
        assert "chaincor" in recipe(name)
