"""Implement ``chaincor table``: check a table and LAMMPS's interpolation of it."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from chaincor.workflows.commands.options import FILE, json_option, option, say, tell
from chaincor.workflows.json_output import finite

if TYPE_CHECKING:
    from chaincor.workflows.tables.report import TableReport

_LEAST_ROWS = 4


class _Range(click.ParamType):
    """Option value LOW:HIGH, a range between two increasing numbers."""

    name = "range"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        try:
            low, high = (float(word) for word in str(value).split(":"))
        except ValueError:
            self.fail(f"{value!r} is no range. Write LOW:HIGH, such as 0.9:2.5", param, ctx)
        return low, high


@click.command()
@click.argument("file", type=FILE)
@option("--keyword K", "section of the file, if it has several")
@option(
    "--style",
    "interpolation in LAMMPS [default: spline]",
    click.Choice(["spline", "linear", "lookup"]),
    default="spline",
)
@option(
    "--kind",
    "kind of table [default: from header and content]",
    click.Choice(["bond", "angle", "dihedral", "pair"]),
)
@option(
    "--range LOW:HIGH",
    "range that the simulation visits [default: energy below 10 kT above the minimum]",
    _Range(),
)
@option(
    "--tolerance X",
    "largest allowed error, as a fraction of the local force [default: the error is only reported]",
    float,
)
@option("--compare", "run LAMMPS on the table and print both forces")
@option(
    "--write NEW",
    "write a new table through these rows, with all digits and with energies that match the forces",
    FILE,
)
@option(
    "--rows N",
    "number of rows N, in the command of LAMMPS and in the new table [default: as in the file]",
    click.IntRange(min=_LEAST_ROWS, max=10_000_000),
)
@json_option
def table(
    file: Path,
    keyword: str | None,
    write: Path | None,
    compare: bool,
    rows: int | None,
    as_json: bool,
    **options: Any,
) -> None:
    """
    Check a table of a bond, an angle, a dihedral or a pair.

    The command compares the force in each row with -dE/dr, and the force that LAMMPS interpolates
    with polynomials through the neighbouring rows. Errors are given as fractions of the local
    force. The exit status is 1 if the table has a fault or if the error exceeds --tolerance.
    """
    from chaincor.workflows.tables.check import check_table

    if write is not None:
        from chaincor.workflows.tables.rewrite import refuse_existing, rewrite_table

        refuse_existing(write)
    given = {name: value for name, value in options.items() if value is not None}
    report = check_table(file, keyword, rows=rows, **given)
    plain, text = report.as_keys(), describe_table(report)
    if compare:
        from chaincor.workflows.tables.compare import compare_with_lammps

        comparison = compare_with_lammps(report)
        plain["comparison"] = comparison.as_keys()
        text = "\n".join([*comparison.lines(), text])
    tell(finite(plain), text, as_json)
    if write is not None:
        rewrite_table(report, write, rows or report.rows)
        say(f"written: {write}", err=as_json)
    if not report.is_good:
        raise click.exceptions.Exit(1)


def describe_table(report: "TableReport") -> str:
    """Write a report as text, with the summary in the last line."""
    lines = [f"{name:<8} {text}" for name, text in report.lines()]
    return "\n".join([report.heading, *lines, report.summary])
