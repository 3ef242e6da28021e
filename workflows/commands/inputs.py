"""Implement ``chaincor inputs``: write a job that ``lmp -in in.chain`` runs."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import click

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.script_plan import JobWishes
from chaincor.workflows.commands.options import ONE_OR_MORE, option, say
from chaincor.workflows.commands.scene_options import SceneCommand, scene_from, scene_options
from chaincor.workflows.grids.submission import SCHEDULERS


@click.command(cls=SceneCommand)
@scene_options("engine", "save", "arrays", "dump")
@option("-o, --output DIR", "folder for the job")
@option("--template FILE", "template that extends job.in.j2")
@option("--set NAME=VALUE", "set a value that the template uses", multiple=True, name="settings")
@option(
    "--submit",
    "scheduler that runs the jobs of a sweep file [default: bash]",
    click.Choice(SCHEDULERS),
)
@option("--site FILE", "lines for the head of a sweep file's submit script")
@option(
    "--jobs-per-task N",
    "number of jobs per task of an array",
    ONE_OR_MORE,
)
@option("--at-once N", "largest number of simultaneous tasks for a sweep file", ONE_OR_MORE)
@option("--dry-run", "print the script and write nothing")
@option("--frames", "also dump the motion; --dump-frames sets the number of frames", name="dump")
@option("--contacts", "also write the list of contacts to contacts.txt")
@option(
    "--restartable",
    "let the job write restart files ('-var restart 20' sets how often) "
    "and resume ('-var resume 1')",
)
@option(
    "--guards",
    "let the job stop, with a reason, if its -var values do not suit its table or numerics",
)
@option(
    "--table-range LOW HIGH",
    "range of bond lengths that the table must cover, for faster chains by -var velocity",
    float,
    nargs=2,
)
@option(
    "--plain",
    "write a short script of about twenty commands, with LAMMPS's own wall and "
    "without an error bar",
)
@option("--explain", "explain every command in a comment")
@option("--force", "replace the files of an existing job")
def inputs(
    scene_file: str | None,
    output: str | None,
    submit: str | None,
    site: str | None,
    jobs_per_task: int | None,
    at_once: int | None,
    dry_run: bool,
    force: bool,
    **options: Any,
) -> None:
    """
    Write a self-contained LAMMPS job: `(cd DIR && lmp -in in.chain)` runs it.

    The numerics are those in the scene, or are chosen for the tolerance. The job prints the
    restitution and its error.
    """
    from chaincor.lammps_inputs.script import SCRIPT_FILE
    from chaincor.lammps_inputs.units.unit_system import UnitSystem
    from chaincor.workflows.campaign.sweep_file import is_sweep
    from chaincor.workflows.job import job_files, write_files

    if dry_run == (output is not None):
        raise InputError(
            "exactly one of -o and --dry-run is needed. Give -o DIR, the folder for the job, "
            "or --dry-run"
        )
    wishes = _wishes_in(options)
    if scene_file is not None and is_sweep(Path(scene_file)):
        given = [name for name, value in options.items() if value is not None]
        if given or output is None:
            wrong = f"--{given[0].replace('_', '-')}" if given else "--dry-run"
            raise InputError(
                f"{wrong} is for a scene, and {scene_file} is a sweep. Leave out {wrong}"
            )
        chosen = {"scheduler": submit, "jobs_per_task": jobs_per_task, "at_once": at_once}
        chosen = {name: value for name, value in chosen.items() if value is not None}
        _write_grid(Path(scene_file), Path(output), chosen, site, force, wishes)
        return
    if any(given is not None for given in (submit, site, jobs_per_task, at_once)):
        raise InputError(
            "--submit, --site, --jobs-per-task and --at-once work only with a sweep file. Give a "
            "file with [axes]"
        )
    scene = scene_from(scene_file, options, beside=("units",))
    if scene_file is not None:
        wishes = replace(wishes, units=UnitSystem.from_file(Path(scene_file)))
    with _doubts_as_notes():
        files = job_files(scene, wishes)
    if output is None:
        click.echo(files[SCRIPT_FILE], nl=False)
        return
    for file in write_files(files, Path(output), force):
        say(file)


@contextmanager
def _doubts_as_notes() -> Iterator[None]:
    """Print warnings about jobs as notes to standard error."""
    from chaincor.workflows.errors import UnsureJobWarning

    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", UnsureJobWarning)
        yield
    for each in found:
        say(f"chaincor: note: {each.message}", err=True)


def _wishes_in(options: dict[str, Any]) -> JobWishes:
    """Move the job's options out of `options`, in which only the scene's options remain."""
    from chaincor.lammps_inputs.own_templates.own_template import OwnTemplate

    template, settings = options.pop("template"), options.pop("settings")
    if settings and template is None:
        raise InputError(f"--set {settings[0][:60]!a} needs a template. Add --template FILE")
    names = [field.name for field in fields(JobWishes) if field.name in options]
    wishes = {name: options.pop(name) for name in names}
    if template is not None:
        wishes["template"] = OwnTemplate.from_file(Path(template), settings)
    return JobWishes(**wishes)


def _write_grid(
    sweep_file: Path,
    folder: Path,
    chosen: dict[str, Any],
    site: str | None,
    force: bool,
    wishes: JobWishes,
) -> None:
    from chaincor.lammps_inputs.small_file import read_small_file
    from chaincor.workflows.campaign.sweep_file import read_sweep
    from chaincor.workflows.grids.grid import MANIFEST, write_grid
    from chaincor.workflows.grids.submission import Submission

    try:
        lines = "" if site is None else read_small_file(Path(site))
    except (OSError, ValueError) as error:
        raise InputError(
            f"the site file {site!a} cannot be read ({error}). Give a readable file"
        ) from None
    submission = Submission(**chosen, site=lines)
    if submission.scheduler == "bash" and submission.jobs_per_task > 1:
        raise InputError("--jobs-per-task is for slurm and pbs. Use --at-once for bash")
    sweep = read_sweep(sweep_file)
    groups = sweep.scenes.groups
    axes = list(dict.fromkeys(key for group in groups for entry in group for key in entry))
    with _doubts_as_notes():
        jobs = write_grid(
            sweep.scenes, axes, folder, submission, replace_existing=force, wishes=wishes
        )
    refused = {name: refusal for name, refusal in jobs.items() if refusal}
    say(f"{len(jobs) - len(refused)} jobs in {folder}, listed in {folder / MANIFEST}")
    scripts = sorted(folder.glob(f"submit*.{submission.scheduler}"), key=lambda p: (len(p.name), p))
    say(f"run them: {', '.join(map(str, scripts))}")
    for name, refusal in refused.items():
        say(f"chaincor: no job for {name}: {refusal}", err=True)
    if refused:
        raise click.exceptions.Exit(1)
