"""``chaincor doctor``: is this machine able to run, what is missing, how to get it."""

import json
import platform
import sys
import tempfile

import click


@click.command()
@click.option("--json", "as_json", is_flag=True, help="print one JSON object")
@click.pass_context
def doctor(ctx: click.Context, as_json: bool) -> None:
    """Say whether this machine can run chaincor, and what is missing."""
    from chaincor.workflows.machine import examine

    findings = examine()
    healthy = all(finding.good for finding in findings)
    if as_json:
        report = {
            "healthy": healthy,
            "python": platform.python_version(),
            "prefix": sys.prefix,
            "temporary_folder": tempfile.gettempdir(),
            "findings": [finding.to_dict() for finding in findings],
        }
        click.echo(json.dumps(report))
    else:
        for finding in findings:
            click.echo(f"{'yes' if finding.good else 'NO '}  {finding.subject}: {finding.text}")
        verdict = "yes, this machine can run chaincor" if healthy else "no: see the lines with NO"
        click.echo(f"\n{verdict}")
    if not healthy:
        ctx.exit(1)
