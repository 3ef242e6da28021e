"""Compare printed output with a page: numbers within error bars, times only in form."""

import math
import re

_NUMBER = r"(?<![\w.])[-+]?(?:\d+\.\d+|\d+)(?:[eE][-+]?\d+)?(?![\w])"
_TOKEN = re.compile(
    rf"(?P<bar>\+-\s*|_error = )?(?P<number>{_NUMBER})(?P<unit>\s(?:s|ms|min|h|MB)\b)?"
)
# Smaller numbers, such as an energy drift, are rounding errors, which differ between processors.
_ROUNDING = 1e-11
# Roundings of another processor may change more digits of a number than these.
_STABLE_DIGITS = 10
# An error bar may differ by this factor between processors, which round differently.
_BAR_FACTOR = 10.0


def agrees(wanted: str, printed: str) -> bool:
    """
    Return whether printed output agrees with the output on a page.

    ``...`` on the page stands for any text. White space is folded. A number followed by ``+- bar``
    or by ``NAME_error = bar`` must agree within the sum of both bars. Digits before ``...`` must be
    equal. A number followed by a unit of time or memory may have any value. Whole numbers must be
    equal. Other numbers must agree to one unit of the last digit that the page shows, or in ten
    digits.

    Parameters
    ----------
    wanted : str
        Output on the page.
    printed : str
        Output of the command.
    """
    pattern, shown = _pattern(" ".join(wanted.split()))
    found = re.fullmatch(pattern, " ".join(printed.split()), re.DOTALL)
    return found is not None and _numbers_agree(shown, list(found.groups()))


def _pattern(wanted: str) -> tuple[str, list[tuple[str, bool, bool]]]:
    """Return a regular expression and, for each number, whether it is a bar and has a unit."""
    parts, shown, at = [], [], 0
    for token in _TOKEN.finditer(wanted):
        if wanted.startswith("...", token.end("number")):
            continue  # the first digits of a shortened number, which are compared as text
        bar, unit = token["bar"] is not None, token["unit"]
        parts.append(_literal(wanted[at : token.start()] + (token["bar"] or "")))
        parts.append(f"({_NUMBER})" + (r"\s(?:s|ms|min|h|MB)\b" if unit else ""))
        shown.append((token["number"], bar, unit is not None))
        at = token.end()
    parts.append(_literal(wanted[at:]))
    return "".join(parts), shown


def _literal(text: str) -> str:
    """Return a pattern for text without numbers, in which ``...`` stands for any text."""
    return ".*?".join(re.escape(part) for part in text.split("..."))


def _numbers_agree(shown: list[tuple[str, bool, bool]], found: list[str]) -> bool:
    for place, ((wanted, is_bar, timed), got) in enumerate(zip(shown, found, strict=True)):
        a, b = float(wanted), float(got)
        if timed:
            continue
        if is_bar:
            if not (a == b or a / _BAR_FACTOR <= b <= a * _BAR_FACTOR):
                return False
            continue
        follows = shown[place + 1] if place + 1 < len(shown) else None
        if follows is not None and follows[1]:
            allowed = float(follows[0]) + float(found[place + 1]) + _last_digit(wanted)
        elif re.fullmatch(r"[-+]?\d+", wanted):
            allowed = 0.0
        elif "e" in wanted.lower() and abs(a) < _ROUNDING:
            allowed = _ROUNDING
        else:
            stable = abs(a) * 10.0**-_STABLE_DIGITS
            allowed = 1.01 * max(_last_digit(wanted), stable)
        if not abs(a - b) <= allowed or not math.isfinite(b):
            return False
    return True


def _last_digit(number: str) -> float:
    """Return one unit of the last digit of a number."""
    mantissa, _, exponent = number.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    return float(10.0 ** (int(exponent or 0) - decimals))
