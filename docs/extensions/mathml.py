"""Render formulas as MathML, which needs no script and no network and suits screen readers."""

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

# Bars of absolute values grow with their content and have no space around them, unlike relations.
_BARS = {"\\lvert": "\\left\\vert", "\\rvert": "\\right\\vert"}
# The glyph of a prime is already raised; as an exponent, it would be too high.
_PRIMES = re.compile(r"<msup>(<mi>[^<]+</mi>)<mi>(&#x0203[234];)</mi></msup>")


def to_mathml(formula: str, display: str = "inline") -> str:
    """Return a LaTeX formula as MathML."""
    for bar, growing in _BARS.items():
        formula = formula.replace(bar, growing)
    text = convert(formula, display=display)
    return _PRIMES.sub(r'<mrow>\1<mo lspace="0" rspace="0">\2</mo></mrow>', text)


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(to_mathml(node.astext()))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(f'<div class="math">{to_mathml(node.astext(), "block")}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
