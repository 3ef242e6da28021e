"""Typeset numbers and text with significant digits, minus signs and symbols."""

import math
import re
from collections.abc import Callable

from markupsafe import Markup, escape


def typeset(text: str) -> str:
    """Replace hyphens before numbers by minus signs, and keep v* on the same line as its number."""
    text = re.sub(r"(?<=e)-0?(?=\d)|(?<![\w-])-(?=\d)", "\u2212", text)
    return text.replace(" v*", "\u00a0v*")


_SYMBOLS = {
    r"\+-": "±",
    r"\beta\b": "η",
    r"\bomega(?=_|\b)": "ω",
    r"\bsqrt\(": "√(",
    r"\bv0\b": "v_0",
    r"\^-(\d+)": r"^(-\1)",
}


def symbols(text: str) -> str:
    """Replace words for the terminal, such as eta and +-, by mathematical symbols."""
    for spelt, symbol in _SYMBOLS.items():
        text = re.sub(spelt, symbol, text)
    return text


def mark_up(text: str) -> Markup:
    """Convert a text to HTML, with powers, indices, and links from ``[words](#place)``."""
    marked = str(escape(typeset(text)))
    marked = re.sub(r"\[([^\]]+)\]\((#[\w-]+)\)", r'<a href="\2">\1</a>', marked)
    marked = re.sub(r"\^(?:\(((?:[^()]|\([^()]*\))*)\)|([^\W_]+))", _inside("sup"), marked)
    return Markup(re.sub(r"_(?:\(([^()]*)\)|([^\W_]+))(?![^<>]*>)", _inside("sub"), marked))


def _inside(tag: str) -> Callable[[re.Match[str]], str]:
    return lambda found: f"<{tag}>{found[1] or found[2]}</{tag}>"


def without_links(text: str) -> str:
    """Replace links by their text."""
    return re.sub(r"\[([^\]]+)\]\(#[\w-]+\)", r"\1", text)


def format_number(value: float | None) -> str:
    """Format a number with a few significant digits; return a dash for a missing number."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == round(value) and abs(value) < 1e6:
        return typeset(f"{value:.0f}")
    return typeset(f"{value:.4g}")


def format_short(value: float) -> str:
    """Format a number with three digits; return a dash for a missing number."""
    return typeset(f"{value:.3g}") if math.isfinite(value) else "–"


def format_fitted(value: float, error: float) -> str:
    """
    Format a fitted number.

    A fit to two points has no error. Its result gets two digits and a remark.
    """
    if math.isfinite(error) or not math.isfinite(value):
        return format_value(value, error)
    return typeset(f"{value:.2g} (no bar)")


def format_value(value: float, error: float) -> str:
    """Format a number with its error as ``0.8098 ± 0.0001``; return a dash for a missing number."""
    if not math.isfinite(value):
        return "–"
    if value == round(value) and error == 0.0:
        return typeset(f"{value:.0f}")
    if not math.isfinite(error) or error <= 0.0:
        return typeset(f"{value:#.4g}")
    digits = min(max(1 - math.floor(math.log10(error)), 0), 9)
    if abs(value) < 1e-3:
        return typeset(f"{value:.1e} ± {error:.0e}")
    digits = min(digits, 5)
    shown = f"{error:.{digits}f}" if error >= 10.0**-digits else f"{error:.0e}"
    return typeset(f"{value:.{digits}f} ± {shown}")
