"""``chaincor check-script``: list the missing parts of a student's script of the chain."""

from pathlib import Path

import click

from chaincor.workflows.commands.options import FILE


@click.command("check-script")
@click.argument("file", type=FILE)
def check_script(file: Path) -> None:
    """
    Say what the LAMMPS script FILE lacks to carry a chain of springs through its collision.

    Five parts are read: units and box, atoms and bonds, springs, motion and wall, output and run.
    If nothing is missing, LAMMPS runs the script, and the motion is judged. Exit status 1 means
    that something is missing. Lesson 1 writes such a script.
    """
    from chaincor.workflows.lessons.script_check import check_script as check

    report = check(file)
    click.echo(repr(report))
    if not report:
        raise SystemExit(1)
