"""Implement ``chaincor sweep``: run many collisions into a store."""

import contextlib
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from chaincor.workflows.commands.options import ONE_OR_MORE, PATH, json_option, option, say, tell
from chaincor.workflows.durations import format_duration
from chaincor.workflows.given import workers_given

if TYPE_CHECKING:
    from chaincor.workflows.campaign.cells import Cells
    from chaincor.workflows.campaign.forecast import Forecast
    from chaincor.workflows.campaign.into_store import IntoStore, Tally

_MOST_POINTS_SHOWN = 30


def _shard(text: str) -> tuple[int, int]:
    number, slash, count = text.partition("/")
    if not (slash and number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count)):
        raise click.BadParameter(f"'{text}' is not a part I/K. Give I from 1 to K, such as 3/10")
    return int(number), int(count)


def _shard_path(store: Path, shard: tuple[int, int] | None) -> Path:
    """Return the path of a shard's store, in a folder beside the store of the whole sweep."""
    if shard is None:
        return store
    return store.with_suffix(".shards") / f"{shard[0]}-of-{shard[1]}.sqlite"


@click.command()
@click.argument("sweep_file", metavar="SWEEP.toml", type=PATH)
@option(
    "--store FILE",
    "store that receives the results [default: from the file, or its name with .sqlite]",
    PATH,
    name="store_path",
)
@option("--dry-run", "print the points, the expected time and the disk space, and run nothing")
@option(
    "--workers N", "number of worker processes on this machine [default: one per core]", ONE_OR_MORE
)
@option("--scheduler ADDRESS", "run on this Dask cluster, tcp://HOST:8786")
@option(
    "--shard I/K",
    "run only part I of K of the points, into its own store [default: NAME.shards/I-of-K.sqlite]",
    _shard,
)
@option("--arrays", "also store contacts, mode energies and final states")
@option("--recompute", "recompute collisions that the store already contains")
@option("--retry-failed", "also retry collisions that failed in an earlier run")
@option(
    "--keep-jobs DIR",
    "keep each LAMMPS job, in a subfolder of this folder",
    PATH,
)
@json_option
def sweep(
    sweep_file: Path,
    store_path: Path | None,
    dry_run: bool,
    workers: int | None,
    scheduler: str | None,
    shard: tuple[int, int] | None,
    keep_jobs: Path | None,
    as_json: bool,
    **wishes: bool,
) -> None:
    """
    Run many collisions into a store.

    Results in the store are not computed again. After an interruption, repeat the same command. In
    SWEEP.toml, [scene] gives the keys that all collisions share, and [axes] the keys that vary:

    \b
    [scene]
    particles = 100
    [axes]
    potential = ["lj", "toda"]
    speed = { from = 0.1, to = 1.0, points = 10 }
    """  # noqa: D301
    from chaincor.analysis.output_paths import judge_folder
    from chaincor.workflows.campaign.cells import Cells
    from chaincor.workflows.campaign.cluster import DaskCluster
    from chaincor.workflows.campaign.into_store import IntoStore
    from chaincor.workflows.campaign.sweep_file import read_sweep
    from chaincor.workflows.outputs import make_folder
    from chaincor.workflows.store.results_store import Store

    if scheduler is not None and workers is not None:
        raise click.UsageError(
            "--workers is for this machine, and a cluster has its own workers. "
            "Leave out --workers or --scheduler"
        )
    asked = read_sweep(sweep_file)
    cells = Cells(asked.scenes, *(shard or (1, 1)))
    path = _shard_path(asked.store, shard) if store_path is None else store_path
    wishes |= {"arrays": wishes["arrays"] or asked.arrays, "details": asked.details}
    cores = workers_given(workers)
    if dry_run:
        _print_forecast(cells, asked.axes, path, wishes, cores, as_json)
        unused = {"--scheduler": scheduler, "--keep-jobs": keep_jobs}
        if left_out := [name for name, value in unused.items() if value is not None]:
            note = "the forecast is for this machine and ignores the options"
            say(f"chaincor: note: {note} {' and '.join(left_out)}", err=True)
        return
    if keep_jobs is not None:
        judge_folder(keep_jobs, "job", ())
    if shard is not None and store_path is None:
        make_folder(path.parent)
    with Store(path) as store:
        into = IntoStore(store, cells, **wishes, keep_jobs=keep_jobs)
        todo = bool(into.todo)
        if keep_jobs is not None:
            _note_jobless(into)
        try:
            if scheduler is not None and todo:
                with DaskCluster(scheduler) as cluster:
                    into.run(cluster, in_flight=cluster.in_flight, progress=not as_json)
            elif todo:
                into.run_by_processes(cores, progress=not as_json)
        except KeyboardInterrupt:
            kept = f"finished results are in {path}. Run the same command to continue"
            say(f"chaincor: {kept}", err=True)
            raise
    fields = {"store": str(path)} | asdict(into.tally)
    tell(fields, _report(into.tally, todo, path), as_json)
    if into.tally.known_failures or into.tally.failed:
        raise click.exceptions.Exit(1)


def _note_jobless(into: "IntoStore") -> None:
    from chaincor.workflows.campaign.points import scene_of

    jobless = sum(scene_of(each).engine != "lammps" for each in into.todo)
    if jobless:
        say(
            f"chaincor: note: {jobless} of {len(into.todo)} collisions are run by the reference "
            "engine, without a LAMMPS job that --keep-jobs could keep",
            err=True,
        )


def _print_forecast(
    cells: "Cells",
    axes: dict[str, int],
    path: Path,
    wishes: dict[str, Any],
    workers: int,
    as_json: bool,
) -> None:
    """Print the first points of a sweep, and the time and disk space that the whole sweep needs."""
    from chaincor.workflows.campaign.cells import WINDOW
    from chaincor.workflows.campaign.forecast import forecast_cells
    from chaincor.workflows.campaign.into_store import IntoStore
    from chaincor.workflows.campaign.tasks import tightest
    from chaincor.workflows.store.results_store import Store

    points = [
        scene.model_dump(mode="json", include=scene.model_fields_set, exclude_none=True)
        for scene in cells.first_scenes(WINDOW if as_json else _MOST_POINTS_SHOWN)
    ]
    if len(cells) > WINDOW:
        cells.points.check()
    with Store(path, read_only=True) if path.exists() else contextlib.nullcontext() as store:
        missing = tightest if store is None else IntoStore(store, [], **wishes).missing
        cost = forecast_cells(cells, missing, arrays=wishes["arrays"], details=wishes["details"])
    forecast = asdict(cost) | {"workers": workers, "wall_seconds": cost.wall_seconds(workers)}
    count = cells.number_of_points
    fields = {"number_of_points": count, "points": points, "store": str(path)}
    text = _forecast(points, count, axes, path, cost, workers)
    tell(fields | {"to_compute": forecast}, text, as_json)


def _forecast(
    points: list[dict[str, Any]],
    count: int,
    axes: dict[str, int],
    path: Path,
    cost: "Forecast",
    workers: int,
) -> str:
    shown = [", ".join(f"{k} = {v}" for k, v in point.items()) for point in points]
    if count > len(shown):
        shown = [*shown, f"... and {count - len(shown)} more"]
    sizes = " x ".join(f"{size} {name}" for name, size in axes.items()) or "the base scene"
    about = "" if cost.sample is None else "about "
    return "\n".join(
        [
            *shown,
            "",
            f"points       {count} ({sizes})",
            f"to compute   {about}{cost.points}, into {path}",
            f"time         about {format_duration(cost.wall_seconds(workers))} with "
            f"{workers} worker{'s' if workers > 1 else ''} on an idle machine; all "
            f"collisions take {format_duration(cost.seconds)} on one core, the "
            f"longest {format_duration(cost.longest)}",
            f"disk         about {_size(cost.disk_bytes)}",
            *([] if cost.sample is None else [f"sample       {cost.sample} collisions"]),
        ]
    )


def _size(count: int) -> str:
    unit, name = (1e9, "GB") if count >= 1e9 else (1e6, "MB")
    return f"{count / unit:.2g} {name}" if count < 100 * unit else f"{count / unit:.0f} {name}"


def _report(tally: "Tally", computed: bool, path: Path) -> str:
    text = f"nothing to compute: {tally.found} results are in {path}"
    if computed:
        took = format_duration(tally.seconds)
        text = f"{tally.computed} computed and {tally.found} found, in {path}; {took}"
    if tally.inexact:
        text += f"\n{tally.inexact} miss their tolerance (the store has the reason)"
    if tally.failed:
        text += (
            f"\n{tally.failed} failed; for the reasons: chaincor show {path} "
            "--where 'failure!=' --columns "
            "potential,particles,velocity,failure_message"
        )
    if tally.known_failures:
        text += (
            f"\n{tally.known_failures} failed in an earlier run and were not "
            "repeated (--retry-failed repeats them)"
        )
    return text
