"""``chaincor table``: whether a LAMMPS table is good, and what its rows and digits leave open."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from chaincor.workflows.commands.options import FILE, json_option, option, tell
from chaincor.workflows.json_output import finite

if TYPE_CHECKING:
    from chaincor.workflows.tables.check import TableReport

_LEAST_ROWS = 4


@click.command()
@click.argument("file", type=FILE)
@option("--keyword K", "the section, where there are several")
@option(
    "--style",
    "how LAMMPS interpolates [default: spline]",
    click.Choice(["spline", "linear", "lookup"]),
    default="spline",
)
@option(
    "--kind",
    "what it is a table of [default: what it looks like]",
    click.Choice(["bond", "angle", "pair"]),
)
@option(
    "--tolerance X",
    "largest error to accept, as a fraction of the largest force [default: it is told, not judged]",
    float,
)
@option(
    "--write NEW", "write a table through these rows, with all digits and energies that fit", FILE
)
@option(
    "--rows N",
    "rows of what is written [default: as many as there are]",
    click.IntRange(min=_LEAST_ROWS, max=10_000_000),
)
@json_option
def table(
    file: Path,
    keyword: str | None,
    write: Path | None,
    rows: int | None,
    as_json: bool,
    **options: Any,
) -> None:
    """
    Check a table of a bond, an angle or a pair, as `bond_style table` and others read it.

    Forces against -dE/dr, rows against each other and the header, and the error of the force that
    rows and digits leave. Exit status 1 where something is wrong, or that error is beyond
    --tolerance.
    """
    from chaincor.workflows.tables.check import check_table

    if rows is not None and write is None:
        raise click.UsageError("--rows is for --write; expected --write NEW beside it")
    given = {name: value for name, value in options.items() if value is not None}
    report = check_table(file, keyword, **given)
    tell(finite(asdict(report)), describe_table(report), as_json)
    if write is not None:
        from chaincor.workflows.tables.rewrite import rewrite_table

        rewrite_table(report, write, rows or report.rows)
        click.echo(f"written: {write}", err=as_json)
    if not report.is_good:
        raise click.exceptions.Exit(1)


def describe_table(report: "TableReport") -> str:
    """Describe a table for people."""
    from chaincor.workflows.tables.check import TOLERANCE

    name = f" {report.keyword}" if report.keyword else ""
    lines = [f"{report.path}{name}: {report.kind} table of {report.rows} rows"]
    if report.error is not None and report.noise is not None:
        lines += [
            f"{'range':<8} {report.low:.9g} to {report.high:.9g}; no force at "
            + (", ".join(f"{zero:.9g}" for zero in report.zeros[:3]) or "any of them"),
            f"{'error':<8} {report.error:.2g} of the largest force, {report.largest_force:.6g}, by "
            f"style {report.style}",
            f"{'noise':<8} {report.noise:.2g}",
            f"{'rows':<8} for {report.tolerance or TOLERANCE:.2g}: "
            + ", ".join(f"{count} {style}" for style, count in report.rows_wanted.items()),
        ]
    lines += [f"{'fault':<8} {each}" for each in report.faults]
    lines += [f"{'note':<8} {each}" for each in report.notes]
    verdict = "faulty" if report.faults else "good"
    if report.is_good and report.tolerance is None:
        verdict = f"consistent, with an error of {report.error:.2g} of the largest force"
    lines.append(f"{'verdict':<8} {verdict}")
    return "\n".join(lines)
