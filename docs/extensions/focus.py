"""Make code and tables reachable by keyboard, and give captions a heading level."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the tests have no Sphinx
    from sphinx.application import Sphinx

_SCROLLS = re.compile(r'<(pre|table|div(?= class="math[" ]))(?=[ >])(?![^>]*tabindex)')


_CAPTION = re.compile(r'role="heading"(?! aria-level)')


def focusable(body: str) -> str:
    """Let code, tables and formulas take the focus, and give captions a level; return the HTML."""
    return _CAPTION.sub('role="heading" aria-level="2"', _SCROLLS.sub(r'<\1 tabindex="0"', body))


def _mark(_app: Sphinx, _page: str, _template: str, context: dict[str, Any], _tree: object) -> None:
    if "body" in context:
        context["body"] = focusable(context["body"])
    # Captions of the navigation are marked as headings without a level.
    tree = "furo_navigation_tree"
    if tree in context:
        context[tree] = context[tree].replace(' role="heading"', "")


def setup(app: Sphinx) -> dict[str, bool]:
    """Change each page when it is written."""
    app.connect("html-page-context", _mark, priority=900)  # after the theme
    return {"parallel_read_safe": True, "parallel_write_safe": True}
