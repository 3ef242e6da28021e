"""Let code and tables take the focus of the keyboard, by which they are scrolled."""

import re
from typing import Any

from sphinx.application import Sphinx

_SCROLLS = re.compile(r"<(pre|table)(?=[ >])(?![^>]*tabindex)")


def focusable(body: str) -> str:
    """Return HTML in which code and tables can be reached by the Tab key."""
    return _SCROLLS.sub(r'<\1 tabindex="0"', body)


def _mark(_app: Sphinx, _page: str, _template: str, context: dict[str, Any], _tree: object) -> None:
    if "body" in context:
        context["body"] = focusable(context["body"])


def setup(app: Sphinx) -> dict[str, bool]:
    """Mark each page when it is written."""
    app.connect("html-page-context", _mark)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
