"""Escape absolute values |x| in docstrings, which reStructuredText would replace."""

import re
from typing import Any

from sphinx.application import Sphinx

_BARS = re.compile(r"\|[^|`]+\|")


def _escape(
    _app: Sphinx, _what: str, _name: str, _obj: Any, _options: Any, lines: list[str]
) -> None:
    math_indent: int | None = None
    for k, line in enumerate(lines):
        indent = len(line) - len(line.lstrip())
        if math_indent is not None and line.strip() and indent <= math_indent:
            math_indent = None
        if line.lstrip().startswith(".. math::"):
            math_indent = indent
        elif math_indent is None and "`" not in line and _BARS.search(line):
            lines[k] = line.replace("|", r"\|")


def setup(app: Sphinx) -> dict[str, bool]:
    """Escape the bars outside of formulas and code."""
    app.connect("autodoc-process-docstring", _escape)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
