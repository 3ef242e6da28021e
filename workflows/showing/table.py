"""Show a result as a table in notebooks, and a list of results as a table everywhere."""

from collections.abc import Sequence
from html import escape
from typing import TypeVar

from chaincor.analysis.observables import TERMS, Observed, rows_of
from chaincor.analysis.showing.lines import count_text
from chaincor.analysis.showing.numbers import root_of_known, with_error
from chaincor.workflows.showing.text import closing, heading

Result = TypeVar("Result", bound=Observed)

# Cells get no colours, because light colours would be wrong in a dark theme.
_CELL = "text-align: left; padding: 0.1em 1em 0.1em 0"
_QUIET = "text-align: left; font-size: 90%; opacity: 0.75"


def html_table(result: Observed) -> str:
    """Return the rows of ``chaincor run`` as an HTML table with a tooltip for each name."""
    lines = [
        f"<tr>{_named(name)}<td style='{_CELL}'>{escape(text)}</td></tr>"
        for name, text in rows_of(result)
    ]
    if result.tolerance_met is False:
        text = f"{result.tolerance:g} NOT MET: {result.reason}"
        lines.append(f"<tr>{_named('tolerance')}<td style='{_CELL}'>{escape(text)}</td></tr>")
    before = "<br>".join(escape(line) for line in heading(result))
    after = "<br>".join(escape(line) for line in closing(result))
    return (
        f"<table><caption style='{_QUIET}'>{before}</caption><tbody>{''.join(lines)}</tbody>"
        f"<tfoot><tr><td colspan='2' style='{_QUIET}'>{after}</td></tr></tfoot></table>"
    )


def _named(name: str) -> str:
    title = f" title='{escape(TERMS[name])}'" if name in TERMS else ""
    return f"<th style='{_CELL}'{title}>{escape(name)}</th>"


def aligned(lines: Sequence[Sequence[str]]) -> str:
    """
    Write rows of cells as aligned columns.

    The library rich is not used here, because it takes minutes for 100000 rows.
    """
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )


class ResultTable(list[Result]):
    """List of results that is displayed as a table with one line per result."""

    def __repr__(self) -> str:
        if not self:
            return "[]"
        return aligned([_HEADINGS, *map(_line, self)])

    def _repr_html_(self) -> str:
        def row(kind: str, texts: tuple[str, ...]) -> str:
            cells = (f"<{kind} style='{_CELL}'>{escape(text)}</{kind}>" for text in texts)
            return f"<tr>{''.join(cells)}</tr>"

        body = "".join(row("td", _line(result)) for result in self)
        return f"<table><thead>{row('th', _HEADINGS)}</thead><tbody>{body}</tbody></table>"


_HEADINGS = ("bonds", "particles", "v0", "eta", "e", "contacts", "end")


def _line(result: Observed) -> tuple[str, ...]:
    speed = f"{result.velocity:.6g}" if result.speed is None else f"{result.speed:.6g} v*"
    missed = "" if result.tolerance_met is not False else ", tolerance not met"
    return (
        result.potential,
        str(result.particles),
        speed,
        with_error(result.restitution, result.restitution_error),
        root_of_known(result.kinematic_restitution, result.restitution_error),
        count_text(result.contacts, result.contacts_range),
        f"{result.ending}{missed}",
    )
