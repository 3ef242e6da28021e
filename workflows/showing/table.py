"""A result as a small table of HTML, for notebooks."""

from html import escape

from chaincor.workflows.showing.described import Described
from chaincor.workflows.showing.terms import TERMS
from chaincor.workflows.showing.text import closing, heading, rows

# Left to the notebook's own theme: no colours, which would be wrong in a dark one.
_CELL = "text-align: left; padding: 0.1em 1em 0.1em 0"
_QUIET = "text-align: left; font-size: 90%; opacity: 0.75"


def html_table(result: Described) -> str:
    """Return what ``chaincor run`` prints as a table; names explain themselves when pointed at."""
    lines = [
        f"<tr>{_named(name)}<td style='{_CELL}'>{escape(text)}</td></tr>"
        for name, text in rows(result)
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
