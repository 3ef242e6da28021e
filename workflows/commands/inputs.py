"""``chaincor inputs``: a job that ``lmp -in in.chain`` runs."""

from pathlib import Path
from typing import Any

import click

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.commands.scene_options import SceneCommand, scene_from, scene_options


@click.command(cls=SceneCommand)
@scene_options("engine", "save", "arrays", "dump")
@click.option("-o", "--output", metavar="DIR", help="folder for the job")
@click.option("--template", metavar="FILE", help="template that extends job.in.j2")
@click.option(
    "--set", "settings", metavar="NAME=VALUE", multiple=True, help="value that the template names"
)
@click.option("--dry-run", is_flag=True, help="print the script and write nothing")
@click.option("--frames", is_flag=True, help="also dump the motion, as --dump-frames says")
@click.option(
    "--table-range",
    nargs=2,
    type=float,
    metavar="LOW HIGH",
    help="bond lengths that the table shall hold at least, for faster chains by -var velocity",
)
@click.option("--explain", is_flag=True, help="say in each file what every command is for")
@click.option("--force", is_flag=True, help="replace a job that is in the folder already")
def inputs(
    scene_file: str | None,
    output: str | None,
    template: str | None,
    settings: tuple[str, ...],
    dry_run: bool,
    frames: bool,
    table_range: tuple[float, float] | None,
    explain: bool,
    force: bool,
    **options: Any,
) -> None:
    """
    Write a self-contained LAMMPS job: `cd DIR && lmp -in in.chain` runs it.

    Its numerics are chosen for a tolerance, or those given; it prints the restitution and its
    error.
    """
    from chaincor.lammps_inputs.own_templates.own_template import OwnTemplate
    from chaincor.lammps_inputs.script import SCRIPT_FILE
    from chaincor.workflows.job import job_files, write_job

    if dry_run == (output is not None):
        raise InputError("expected either -o DIR, the folder for the job, or --dry-run")
    if settings and template is None:
        raise InputError(f"--set {settings[0][:60]!a} is for a template; expected --template FILE")
    scene = scene_from(scene_file, options)
    wishes: dict[str, Any] = {
        "dump": frames,
        "explain": explain,
        "table_range": table_range,
        "template": None if template is None else OwnTemplate.from_file(Path(template), settings),
    }
    if output is None:
        click.echo(job_files(scene, **wishes)[SCRIPT_FILE], nl=False)
        return
    for file in write_job(scene, Path(output), replace_existing=force, **wishes):
        click.echo(file)
