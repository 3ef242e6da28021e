"""``chaincor inputs``: a job that ``lmp -in in.chain`` runs."""

from pathlib import Path
from typing import Any

import click

from chaincor.workflows.commands.scene_options import scene_from, scene_options


@click.command()
@scene_options("engine", "save", "arrays", "dump")
@click.option("-o", "--output", metavar="DIR", required=True, help="folder for the job")
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
    output: str,
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
    from chaincor.workflows.job import write_job

    scene = scene_from(scene_file, options)
    files = write_job(
        scene,
        Path(output),
        dump=frames,
        explain=explain,
        table_range=table_range,
        replace_existing=force,
    )
    for file in files:
        click.echo(file)
