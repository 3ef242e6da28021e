"""Implement ``chaincor collect``: read the logs of a grid of jobs into a store."""

from collections import Counter
from pathlib import Path

import click

from chaincor.workflows.commands.options import json_option, option, tell


@click.command()
@click.argument("folder", metavar="DIR")
@option("-o, --output STORE", "store that receives the results", required=True)
@json_option
def collect(folder: str, output: str, as_json: bool) -> None:
    """
    Read the logs of a grid of jobs, made by `chaincor inputs SWEEP.toml -o DIR`, into a store.

    The command lists jobs that are missing, unfinished or failed, and prints LAMMPS's message for
    each failed job. The exit status is 1 if the list is not empty. `chaincor show` and `chaincor
    plot` read the store.
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
