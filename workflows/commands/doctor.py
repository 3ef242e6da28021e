"""Implement ``chaincor doctor``: check this machine, and list missing libraries."""

import platform
import sys
import tempfile
from dataclasses import asdict
from typing import Any

import click

from chaincor.workflows.commands.options import json_option, option, tell


@click.command()
@json_option
@option("--warm", "first compile the loops of all named bonds, and keep them in the cache")
def doctor(as_json: bool, warm: bool) -> None:
    """
    Check whether this machine can run chaincor, and list what each command lacks.

    A library in brackets is needed only for some uses of a command. With --warm, the command
    compiles the loops of all named bonds beforehand. The first collision with such a bond then
    takes no longer than later collisions.
    """
    from chaincor.workflows.machine import command_needs, examine, warm_up

    if warm:
        for name, seconds in warm_up():
            click.echo(f"compiled {name} in {seconds:.1f} s", err=as_json)
    findings = examine()
    commands = command_needs(findings)
    healthy = all(finding.good for finding in findings)
    report = {
        "healthy": healthy,
        "python": platform.python_version(),
        "prefix": sys.prefix,
        "temporary_folder": tempfile.gettempdir(),
        "findings": [asdict(finding) for finding in findings],
        "commands": commands,
    }
    lines = [f"{'yes' if f.good else 'NO '}  {f.subject}: {f.text}" for f in findings]
    lines += ["", "command needs (and for some uses)", *map(_describe, commands), ""]
    lines.append("yes, this machine can run chaincor" if healthy else "no: see the lines with NO")
    tell(report, "\n".join(lines), as_json)
    if not healthy:
        raise click.exceptions.Exit(1)


def _describe(command: dict[str, Any]) -> str:
    always = ", ".join(command["needs"]) or "nothing more"
    uses = "; ".join(f"{library} for {use}" for library, use in command["also"].items())
    lacks = f" - lacks {', '.join(command['missing'])}" if command["missing"] else ""
    text = f"{command['command']}: {always}{f' ({uses})' if uses else ''}{lacks}"
    return f"{'yes' if command['works'] else 'NO '}  {text}"
