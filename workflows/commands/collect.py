"""``chaincor collect``: read the logs of a grid of jobs into a store."""

from collections import Counter
from pathlib import Path

import click

from chaincor.workflows.commands.options import json_option, option, tell


@click.command()
@click.argument("folder", metavar="DIR")
@option("-o, --output STORE", "store for the results", required=True)
@json_option
def collect(folder: str, output: str, as_json: bool) -> None:
    """
    Read the logs of a grid of jobs, `chaincor inputs SWEEP.toml -o DIR`, into a store.

    Names the jobs that are missing, unfinished or failed, the last with LAMMPS's words; the exit
    status is 1 while there are any. `chaincor show` and `chaincor plot` read the store.
    """
    from chaincor.workflows.grids.collect import collect_grid
    from chaincor.workflows.store.results_store import Store

    jobs = collect_grid(Path(folder))
    with Store(output) as store:
        store.record([(job.scene, job.row) for job in jobs if job.scene and job.row])
    counts = dict(Counter(job.state for job in jobs))
    left = [job for job in jobs if job.state != "done"]
    plain = [{"folder": j.folder, "state": j.state, "words": j.words} for j in left]
    said = ", ".join(f"{count} {state}" for state, count in sorted(counts.items()))
    lines = [f"{len(jobs)} jobs: {said}; results in {output}"]
    lines += [f"{job.state:10s} {job.folder}: {job.words}" for job in left]
    found = {"store": output, "jobs": len(jobs), **counts, "left": plain}
    tell(found, "\n".join(lines), as_json)
    if left:
        raise click.exceptions.Exit(1)
