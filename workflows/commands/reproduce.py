"""Implement ``chaincor reproduce``: recompute the figures of the paper, and judge its claims."""

from pathlib import Path
from typing import Any

import click

from chaincor.workflows.commands.options import FOLDER, ONE_OR_MORE, option, say


@click.command()
@option(
    "-o, --output",
    "folder for the report, its figures, their data and the results store",
    FOLDER,
    default=Path("reproduction"),
    show_default=True,
    name="folder",
)
@click.option(
    "--quick/--full",
    "quick",
    default=True,
    show_default=True,
    help="--quick takes minutes, with errors of 1e-5; --full takes half an "
    "hour, with errors of 1e-7 and more points",
)
@option("--workers", "number of worker processes", ONE_OR_MORE, default=2, show_default=True)
@option("--rocrate", "also describe the folder as an RO-Crate", name="as_crate")
@option("--json", "print the contents of report.json", name="as_json")
def reproduce(folder: Path, quick: bool, workers: int, as_crate: bool, as_json: bool) -> None:
    """
    Recompute the paper by LAMMPS and by the reference engine, and judge each of its claims.

    Finished results are kept in a store beside the report. An interrupted run therefore continues
    where it stopped.
    """
    from chaincor.workflows.reproduce import reproduction

    contents = reproduction.reproduce(
        folder, quick=quick, workers=workers, progress=not as_json, as_crate=as_crate
    )
    if as_json:
        say((folder / "report.json").read_text())
    else:
        say(describe_contents(contents, folder))
    if contents["health"]["by_lammps"] == 0:
        raise click.exceptions.Exit(1)


def describe_contents(contents: dict[str, Any], folder: Path) -> str:
    """Write a report as text, with curves of eta, verdicts and times."""
    from chaincor.workflows.pages.typesetting import format_number
    from chaincor.workflows.reproduce.report import describe_found

    health = contents["health"]
    width = max(len(row["claim"]) for row in contents["verdicts"])
    verdicts = [
        f"{row['verdict']:<28} {row['claim']:<{width}}  "
        f"paper {'yes' if row['is_trend'] else format_number(row['paper'])}, "
        f"found {describe_found(row)}"
        for row in contents["verdicts"]
    ]
    agreement = (
        f"{health['compared']} of {health['points']} points were computed by "
        "LAMMPS and the reference engine (LAMMPS's value is shown in "
        f"{health['by_lammps']}); "
        f"{health['compared'] - health['disagreements']} agree within LAMMPS's "
        f"own error bar,  {health['compared'] - len(health['blunt'])} with "
        f"summed bars of less than {health['sharp']:.0e}; largest error bar "
        f"{health['largest_error']:.1e}"
    )
    times = ", ".join(f"{name} {seconds:.0f} s" for name, seconds in contents["seconds"].items())
    title = "restitution eta of chains of lj, toda and log bonds"
    lines = [title, "", *_curve_lines(contents["curves"]), "", *verdicts, "", agreement, times]
    return "\n".join([*lines, f"report: {folder / 'report.html'}"])


def _curve_lines(points: list[dict[str, Any]]) -> list[str]:
    """Write the curves as lines of text, in which * marks results of the reference engine."""
    names = list(dict.fromkeys(point["potential"] for point in points))
    cells = {}
    for p in points:
        mark = " " if p["source"] == "lammps" else "*"
        text = f"{p['restitution']:.6f} {p['restitution_error']:.0e}{mark}"
        cells[p["speed"], p["potential"]] = text if p["source"] else "-"
    lines = ["  v0/v*  " + "".join(f"{name:<18}" for name in names)]
    for speed in sorted({speed for speed, _ in cells}):
        row = "".join(f"{cells.get((speed, name), '-'):<18}" for name in names)
        lines.append(f"{speed:8.4g} {row}")
    if any(p["source"] == "reference" for p in points):
        refused = [p["lammps_failure"] for p in points if p["lammps_failure"]]
        reason = f"not run by LAMMPS: {refused[0]}" if refused else None
        lines += ["", f"* reference engine; {reason or 'LAMMPS missed the target error'}"]
    return lines
