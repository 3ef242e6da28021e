"""Read numbers in answers that are given as text, such as ``"9.3 %"`` and ``"sqrt(2)"``."""

import math
import re

from chaincor.lammps_inputs.bonds.formula_text import FUNCTIONS, number_in
from chaincor.lammps_inputs.errors import PotentialError
from chaincor.workflows.lessons.number_words import digits_for_words

_CALLS = "|".join(FUNCTIONS)
_DIGIT = "(?:\\d+\\.?\\d*|\\.\\d+)(?:e[+-]?\\d+)?"
# Notations of LaTeX, of Unicode and of programs, each with the notation of a formula.
_NOTATIONS = [
    (re.compile(pattern), meaning)
    for pattern, meaning in (
        (r"^\*\*([^*]+)\*\*$", r"\1"),
        (r"\\[,;! ()]|[$`]|\\left|\\right", " "),
        (r"(?<=[\d%]) [–—] [^\W\d].*", ""),
        (r"\\sqrt *\{([^{}]*)\}", r"sqrt(\1)"),
        (r"\\[dt]?frac *\{([^{}]*)\} *\{([^{}]*)\}", r"((\1)/(\2))"),
        (r"\\times|\\cdot|[·×∙]", "*"),
        (r"\\approx|\\simeq|\\sim|\\propto|[≈≃~∝]", "≈"),
        (r"\\leq?\b|<=|[≤<→⇒]|\\to\b|->", "="),
        (r"\\pm|\+/?-", "±"),
        (r"\\(?=[a-zA-Z%])|\b(?:np|numpy|math)\.", ""),
        (r"[−–]|\bminus (?=[\d.])", "-"),
        (r"÷|(?<=\d)(?: : |:)(?=\d)", "/"),
        (r"π", " pi "),
        (r"√|\broot(?= ?\d)", "sqrt"),
        (r"sqrt ?(\d[\d.]*)", r"sqrt(\1)"),
        (r"\^ ?\{([^{}]*)\}", r"^(\1)"),
        (r"\bO\((\w+(?:\^|\*\*).*)\)$", r"\1"),
        (r"\bpow\((\d+), ?(\d+)\)", r"\1^\2"),
        (rf"\b({_CALLS}) \(", r"\1("),
        (r"(?<=\d)[dD](?=[+-]?\d)", "e"),
        (r"(?<=\d) 10 ?\^", "*10^"),
        (r"(?<=[*x]) ?10-(?=\d)", " 10^-"),
        (r"(?<=\d) ?x ?(?=\d)", "*"),
        (r"^[x*] ?(?=\d)", ""),
        (r"(?<=\d)(?:st|nd|rd|th)\b", ""),
        (r"-?fold\b", " times"),
        # Only the comma between two digits of a number is a decimal comma.
        (r"(?<=\d),(?=\d)", "."),
        # A number before pi or a function is a factor.
        (rf"(?<=[\d)]) *(?=pi\b|(?:{_CALLS})\()", "*"),
    )
]
# Longer texts are not answers, and would take long to search.
_LONGEST = 1000
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻·", "0123456789-.")
_RAISED = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+(?:·[⁰¹²³⁴⁵⁶⁷⁸⁹]+)?")
# A comment in brackets after a number, and an uncertainty.
_COMMENT = re.compile(r"(?:(?<=[\w%).])|(?<=v\*)) +\([^()]*\)|(?<=\d)\(\d+\)")
_UNCERTAINTY = re.compile(rf"(?<=[\d%]) *± *{_DIGIT} *%?")
# Circumstances after a number, such as "at n = 40".
_CIRCUMSTANCE = re.compile(
    r"(?<=\d|%|\)) *(?:at|because|for|if|in|since|than|when|where|with)\b.*", re.S
)
_SHARES = {"%": 100.0, "percent": 100.0, "per cent": 100.0, "pct": 100.0, "ppm": 1e6}
_SHARE = re.compile(rf" *({'|'.join(_SHARES)})(?!\w)")
# A power of the number of particles or of the step states its exponent.
_POWER = re.compile(r"(?:[A-Z] ?)?(?:h|n|N|d ?t) ?(?:\^|\*\*) ?(\(.*\)|.*)")
_FORMULA = re.compile(rf"(?:{_CALLS})(?=\()|\bpi\b|(?<![^\W\d]){_DIGIT}|[-+*/^()]| +")
_NAME = r"[^\W\d][\w₀]*"
# The unit of a velocity or momentum may follow as a factor.
_UNIT = re.compile(r"(?<=[\d)])[ *]*(?:n[ *]*)?v(?:\*|_star|_?0|₀)(?!\w)")
# A formula with a name that has no value, such as "2n" and "1 - e^2".
_UNKNOWN = re.compile(
    rf"[\d)] *[-+/*^] *(?!(?:{_CALLS}|pi)\b){_NAME}"
    rf"|(?<!\w)(?!(?:{_CALLS}|pi)\b){_NAME}(?:-| - | *[+^*/] *)[\d(]"
    r"|\d *(?:n|omega|w)\b"
)
# Commas within brackets do not separate answers.
_SEPARATOR = re.compile(r"(?:,\s+|\s*[;&|\n]\s*| and |,$)(?![^()]*\))")
_GAP = re.compile(r"(?<=\d) +(?=[\d-])| / |(?<=\d),(?=\d)")


def numbers_of(text: str, count: int = 1) -> list[float]:
    """
    Return the numbers that a text states, if possible `count` of them.

    Words and units beside a number are allowed. The list is empty if the text states no number.
    """
    if len(text) > _LONGEST:
        return []
    text = digits_for_words(_without_brackets(text))
    if count > 1 and re.fullmatch(rf"[-+]?{_DIGIT}(?:\s+[-+]?{_DIGIT})+", text):
        return [float(one) for one in text.split()]
    clauses = _SEPARATOR.split(text)
    stated = [(one, number) for one in clauses if (number := _stated(one)) is not None]
    numbers = [number for _, number in stated]
    if count == 1 and len(stated) > 1:
        # Later numbers with words are remarks, such as "0.06, n = 40".
        if re.match(r"(?:so|thus|hence|therefore|then)\b", stated[-1][0]):
            return numbers[-1:]
        first, *later = stated
        same = all(math.isclose(first[1], number, rel_tol=0.02) for _, number in later)
        if same or all(re.search(r"[^\W\d]", one) for one, _ in later):
            return numbers[:1]
    if len(numbers) == 1 < count and re.search(r"\b(?:both|each)\b", text):
        return numbers * count
    if len(numbers) < count and len(clauses) == 1:
        parts = [_stated(one) for one in _GAP.split(text)]
        if len(parts) == count and None not in parts:
            return [part for part in parts if part is not None]
    return numbers


def _without_brackets(text: str) -> str:
    """Return a text without dollar signs, and without brackets around the whole list."""
    text = re.sub(r"^(?:np\.)?array\((.*)\)$", r"\1", text.strip().strip("$").strip(), flags=re.S)
    inside = re.fullmatch(r"[\[({]([^\[\](){}]*)[\])}]", text)
    return inside[1].strip() if inside else text


def _stated(text: str) -> float | None:
    """Return the number that a text states: a decimal, a percentage or a formula."""
    text = _RAISED.sub(lambda raised: f"^({raised[0].translate(_SUPERSCRIPTS)})", text)
    text = " ".join(text.split()).strip("'\"")
    for pattern, meaning in _NOTATIONS:
        text = pattern.sub(meaning, text)
    text = re.sub(r"^[^:(]*: (?=.*\d)", "", text)  # A label, such as "0.1 v*: ".
    text = _UNCERTAINTY.sub("", " ".join(text.split())).lstrip("±≈ ").rstrip(",: ")
    if (number := _value(text)) is not None:
        return number
    text = _CIRCUMSTANCE.sub("", _COMMENT.sub("", text))
    # The result stands after the last equals sign. If an answer gives an exact and a rounded
    # result, the rounded result comes second.
    for side in reversed(text.split("=")):
        for number in (*map(_value, side.split("≈")), _beside_words(side)):
            if number is not None:
                return number
    return None


def _value(text: str) -> float | None:
    """Return the value of a formula or of a percentage; None for any other text."""
    text = text.strip()
    share = _SHARE.search(text)
    if share is not None and share.end() == len(text):
        number = _value(text[: share.start()])
        # After the division, a percentage keeps its number of digits.
        return None if number is None else float(f"{number / _SHARES[share[1]]:.12g}")
    if power := _POWER.fullmatch(text):
        text = power[1]
    try:
        return number_in(text.rstrip("."))
    except PotentialError:
        return None


def _beside_words(text: str) -> float | None:
    """Return the only number between words; None if there are several, or unknown names."""
    text = re.sub(rf"^{_NAME}(?:\*|_\w+)? *[=:] *", "", text)
    text = _UNIT.sub(" ", text)
    if _UNKNOWN.search(text):
        return None
    runs, end = [""], 0
    for piece in _FORMULA.finditer(text):
        if piece.start() > end:
            runs.append("")
        runs[-1] += piece[0]
        end = piece.end()
        share = _SHARE.match(text, end)
        if share is not None and piece[0].strip():
            runs[-1] += share[0]
            end = share.end()
    values = [_value(run.strip(" *")) for run in runs if re.search(r"\d|pi", run)]
    return values[0] if len(values) == 1 else None
