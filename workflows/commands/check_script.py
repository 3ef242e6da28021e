"""Implement ``chaincor check-script``: list the missing parts of a student's script."""

from pathlib import Path

import click

from chaincor.workflows.commands.options import FILE


@click.command("check-script")
@click.argument("file", type=FILE)
def check_script(file: Path) -> None:
    """
    List what the LAMMPS script FILE lacks to simulate the collision of a chain of springs.

    The command reads five parts: units and box, atoms and bonds, springs, motion and wall, output
    and run. If no part is missing, LAMMPS runs the script, and the motion is checked. The exit
    status is 1 if a part is missing or wrong. Lesson 1 writes such a script.
    """
    from chaincor.workflows.lessons.script_check import check_script as check

    report = check(file)
    click.echo(repr(report))
    if not report:
        raise SystemExit(1)
