"""Replace number words in a text by digits, such as "thirty" and "a tenth"."""

import math
import re

_SMALL = (
    "zero one two three four five six seven eight nine ten eleven twelve thirteen fourteen "
    "fifteen sixteen seventeen eighteen nineteen"
)
_TENS = "twenty thirty forty fifty sixty seventy eighty ninety"
_VALUES = {word: value for value, word in enumerate(_SMALL.split())}
_VALUES |= {word: 10 * value for value, word in enumerate(_TENS.split(), start=2)}
_PARTS = {"half": 2, "quarter": 4, "tenth": 10, "hundredth": 100, "ten-thousandth": 10**4}
_ORDERS = {"first": 1, "second": 2, "third": 3, "fourth": 4, "eighth": 8}
_WORD = "|".join(sorted((*_VALUES, "a", "an", "hundred", "thousand"), key=len, reverse=True))
_AND = r"(?:(?:(?<=hundred)|(?<=thousand)) and)?"
_WHOLE = re.compile(rf"\b(?:{_WORD})(?:{_AND}[ -](?:{_WORD}))*\b")
_PART = re.compile(rf"\b(?:(?:one|an?)[ -])?({'|'.join(sorted(_PARTS, key=len, reverse=True))})\b")
_ORDER = re.compile(rf"\b({'|'.join(_ORDERS)})(?:[ -]order)?$")
# Fractions and ordinals after a number word, such as "two thirds"; only the _PARTS are read.
_OTHER_PARTS = re.compile(rf"\b(?:{_WORD})[ -](?:first|second|third|halves|quarters|\w+th)s?\b")


def digits_for_words(text: str) -> str:
    """Return the text with digits for number words; a text with digits stays as it is."""
    if re.search(r"\d", text):
        return text
    lower = re.sub(r"(?<=\w)fold\b", " fold", text.lower())
    found = _PART.sub(lambda part: f"1/{_PARTS[part[1]]}", lower)
    if _OTHER_PARTS.search(found):
        return text
    found = _WHOLE.sub(_whole, found)
    found = _ORDER.sub(lambda order: str(_ORDERS[order[1]]), found)
    return found if found != lower else text


def _whole(words: re.Match[str]) -> str:
    """Return the digits of a whole number such as "two hundred"; other words stay as they are."""
    thousands = number = 0
    room = math.inf  # the next word must have a smaller value
    for word in re.split(r" and |[ -]", words[0]):
        if word == "thousand":
            thousands, number, room = 1000 * max(number, 1), 0, 1000
        elif word == "hundred":
            number, room = 100 * max(number, 1), 100
        elif word in _VALUES:
            if _VALUES[word] >= room:
                return words[0]
            number, room = number + _VALUES[word], 10 if _VALUES[word] >= 20 else 0
    return str(thousands + number) if thousands + number or "zero" in words[0] else words[0]
