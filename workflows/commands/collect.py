"""``chaincor collect``: the logs of a grid of jobs into a store."""

from collections import Counter
from pathlib import Path

import click

from chaincor.workflows.json_output import json_text


@click.command()
@click.argument("folder", metavar="DIR")
@click.option("-o", "--output", metavar="STORE", required=True, help="store for the results")
@click.option("--json", "as_json", is_flag=True, help="print one JSON object")
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
    if as_json:
        lines = [{"folder": j.folder, "state": j.state, "words": j.words} for j in left]
        click.echo(json_text({"store": output, "jobs": len(jobs), **counts, "left": lines}))
    else:
        said = ", ".join(f"{count} {state}" for state, count in sorted(counts.items()))
        click.echo(f"{len(jobs)} jobs: {said}; results in {output}")
        for job in left:
            click.echo(f"{job.state:10s} {job.folder}: {job.words}")
    if left:
        raise SystemExit(1)
