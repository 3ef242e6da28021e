"""Report the check of a table: fields, a summary, printed lines and a figure."""

import math
from dataclasses import dataclass, field, fields
from html import escape
from typing import TYPE_CHECKING, Any

from chaincor.workflows.tables.lammps_curve import Style, TableKind

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from chaincor.workflows.tables.judge import Judge

_POOR = 0.1
_CELL = "text-align: left; padding: 0.1em 1em 0.1em 0"


@dataclass(frozen=True, repr=False)
class TableReport:
    """
    Result of the check of a table.

    Attributes
    ----------
    path, keyword : str
        The file and the section.
    kind, style : str
        Kind of interaction, and interpolation in LAMMPS.
    rows, style_rows : int
        Numbers of rows in the file and in LAMMPS's style command.
    tolerance : float or None
        Largest allowed error, as a fraction of the local force, if one was given.
    faults, notes : tuple of str
        Faults and further remarks, one sentence each.
    low, high : float
        First and last length or angle.
    range : (float, float) or None
        Range in which the table is judged; None if the rows form no valid table.
    range_reason : str
        Reason for the choice of the range.
    good_range : (float, float) or None
        Longest interval in the range with an error below the tolerance, or below 0.01 if no
        tolerance was given.
    zeros : tuple of float
        Zeros of the force.
    largest_force : float
        Largest force in any row, in the unit of the file.
    error : float or None
        Largest error of LAMMPS's force within the range, as a fraction of the local force.
    worst : float or None
        Length or angle of the largest error.
    core_error : float or None
        Largest error below the range; None if the table has no rows there.
    noise, style_error : float or None
        Largest error from noise and rounding of the forces, and largest error from interpolation.
    warnings : int
        Number of forces that LAMMPS calls inconsistent with -dE/dr.
    rows_wanted : dict of str to int
        Number of rows with which each style of LAMMPS meets the tolerance, or 0.001 if no tolerance
        was given.
    cause, advice : str
        Main cause of the error, and the remedy.
    """

    path: str
    keyword: str
    kind: TableKind
    style: Style
    rows: int
    tolerance: float | None
    faults: tuple[str, ...]
    notes: tuple[str, ...] = ()
    low: float = math.nan
    high: float = math.nan
    range: tuple[float, float] | None = None
    range_reason: str = ""
    good_range: tuple[float, float] | None = None
    zeros: tuple[float, ...] = ()
    largest_force: float = math.nan
    error: float | None = None
    worst: float | None = None
    core_error: float | None = None
    noise: float | None = None
    style_error: float | None = None
    style_rows: int = 0
    warnings: int = 0
    rows_wanted: dict[str, int] = field(default_factory=dict)
    cause: str | None = None
    advice: str = ""
    verdict: str = ""
    curves: "Judge | None" = field(default=None, compare=False)

    @property
    def is_good(self) -> bool:
        """Whether the table has no faults."""
        return not self.faults

    @property
    def summary(self) -> str:
        """Summary of one or two sentences."""
        if self.verdict:
            return f"Not good: {self.verdict}"
        if self.faults:
            more = f" ({len(self.faults)} faults)" if len(self.faults) > 1 else ""
            return f"Not good{more}: {self.faults[0]}."
        if self.error is None or self.range is None:
            return "No table."
        if self.largest_force == 0.0 and self.error == 0.0:
            return "Good: no interaction."
        where = f"between {self.range[0]:.4g} and {self.range[1]:.4g}"
        bound = f"{percent(self.error)} of the local force {where}."
        text = f"Good to {bound}"
        if self.error > _POOR:
            text = f"The rows are sound, but LAMMPS's force is wrong by up to {bound}"
        advice = self.advice
        if self.cause == "interpolation" and self.rows_wanted:
            options = " or ".join(f"{name} {count}" for name, count in self.rows_wanted.items())
            advice = f"use {self.kind}_style table {options}"
        return f"{text} {sentence(advice)}".strip()

    def as_keys(self) -> dict[str, Any]:
        """Return all fields and the summary for JSON."""
        found = {each.name: getattr(self, each.name) for each in fields(self)}
        del found["curves"], found["verdict"]
        return found | {"summary": self.summary}

    def lines(self) -> list[tuple[str, str]]:
        """Return the printed lines as pairs of name and text."""
        found = []
        if self.error is not None and self.range is not None:
            zeros = ", ".join(f"{zero:.9g}" for zero in self.zeros[:3]) or "none of them"
            found = [
                (
                    "rows",
                    f"{self.rows} from {self.low:.9g} to {self.high:.9g}; no force at {zeros}",
                ),
                ("range", f"{self.range[0]:.6g} to {self.range[1]:.6g}: {self.range_reason}"),
                (
                    "error",
                    f"{percent(self.error)} of the local force, near {self.worst or 0:.4g}, by "
                    f"style {self.style} {self.style_rows}",
                ),
            ]
            if self.core_error is not None:
                found.append(("core", f"{percent(self.core_error)} below {self.range[0]:.4g}"))
            if self.rows_wanted:
                wanted = ", ".join(f"{style} {count}" for style, count in self.rows_wanted.items())
                found.append(("styles", f"{wanted} for {percent(self.tolerance or 1e-3)}"))
        found += [("fault", each) for each in self.faults]
        return found + [("note", each) for each in self.notes]

    @property
    def heading(self) -> str:
        """First printed line."""
        name = f" {self.keyword}" if self.keyword else ""
        return f"{self.path}{name}: {self.kind} table of {self.rows} rows"

    def __repr__(self) -> str:
        return f"<{self.heading}. {self.summary}>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='{_CELL}'>{escape(name)}</th><td style='{_CELL}'>{escape(text)}</td>"
            "</tr>"
            for name, text in self.lines()
        )
        return (
            f"<table><caption>{escape(self.heading)}</caption><tbody>{rows}</tbody><tfoot><tr>"
            f"<td colspan='2' style='{_CELL}'>{escape(self.summary)}</td></tr></tfoot></table>"
        )

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """
        Draw the given force, LAMMPS's force and -dE/dr within the range; return the axes.

        Raise InputError if the rows form no valid table.
        """
        from chaincor.workflows.tables.figure import draw_forces

        return draw_forces(self, ax)


def percent(part: float) -> str:
    """Write a fraction of the force as a percentage."""
    value = 100.0 * part
    if value >= 1e4:
        return f"{value:.1e} %"
    return f"{value:.2g} %" if value < 100.0 else f"{value:.0f} %"


def sentence(advice: str) -> str:
    """Return advice as a sentence; empty advice stays empty."""
    if not advice:
        return ""
    text = advice[0].upper() + advice[1:]
    if text.startswith("More rows"):
        return f"{text} would help."
    return f"{text}."
