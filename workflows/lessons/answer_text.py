"""Read numbers in answers that are given as text, such as ``"9.3 %"`` and ``"sqrt(2)"``."""

import re

from chaincor.lammps_inputs.bonds.formula_text import number_in
from chaincor.lammps_inputs.errors import PotentialError

# Signs that stand for the operators of a formula.
_SIGNS = {"−": "-", "–": "-", "·": "*", "×": "*", "^": "**", "π": "pi", "√": "sqrt"}
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_RAISED = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+")
# Text before a number: a label such as `eta =`, a word such as "about", or the sign ±.
_BEFORE = re.compile(
    r"^(?:[^\W\d][\w*]*(?: [^\W\d]\w*)* ?= ?|(?:about|approximately|after|order|≈|~) ?"
    r"|(?:a )?factor (?:of )?|(?:±|\+/?-) ?)",
    re.I,
)
# Units and comments after a number. A comment stands in brackets after a space.
_UNIT = (
    r"(?:v\*|v_star|(?:time ?)?steps?|times?|(?:-| )?fold|x|n|v0|v₀|rows?|contacts?|events?|"
    r"particles?|collisions?|bonds?|lengths?|units?|rad|energy|smaller|larger|longer|more|"
    r"of|the|in|per|eta|η)"
)
_AFTER = re.compile(rf"(?:(?<=\d)|(?<=[\d.)] )|(?<=% )){_UNIT}(?:[ /]{_UNIT})*$", re.I)
_COMMENT = re.compile(r" +\([^()]*\)$")
_PER_CENT = re.compile(r" ?(?:%|per ?cent)$", re.I)
# A comma with a space after it separates numbers; a comma between digits is a decimal comma.
_SEPARATOR = re.compile(r", +| *; *| and |(?<=\d) +(?=\d)")


def number_of(text: str) -> float | None:
    """Return the number in a text: a decimal, a percentage or a formula; None without a number."""
    for sign, meaning in _SIGNS.items():
        text = text.replace(sign, meaning)
    text = _RAISED.sub(lambda raised: f"**({raised[0].translate(_SUPERSCRIPTS)})", text)
    text = re.sub(r"sqrt ?(\d[\d.]*)", r"sqrt(\1)", " ".join(text.split()))
    text = re.sub(r"(?<=\d) x (?=\d)", "*", re.sub(r"^x(?=\d)", "", text))
    text = _AFTER.sub("", _COMMENT.sub("", _BEFORE.sub("", text))).strip()
    share = _PER_CENT.search(text)
    # Only the comma between two digits of a number is a decimal comma.
    text = re.sub(r"(?<=\d),(?=\d)", ".", _PER_CENT.sub("", text))
    try:
        number = number_in(text)
    except PotentialError:
        return None
    # After the division by 100, a percentage keeps its number of digits.
    return float(f"{number / 100.0:.12g}") if share else number


def numbers_of(text: str) -> list[float] | None:
    """Return several numbers that a text separates by commas, spaces or "and"; otherwise None."""
    parts = [number_of(part) for part in _SEPARATOR.split(text.strip().strip("[]()"))]
    numbers = [part for part in parts if part is not None]
    return numbers if len(numbers) == len(parts) > 1 else None
