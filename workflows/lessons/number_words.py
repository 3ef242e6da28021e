"""Replace number words in a text by digits, such as "thirty" and "a tenth"."""

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
_WHOLE = re.compile(rf"\b(?:{_WORD})(?:[ -](?:{_WORD}))*\b")
_PART = re.compile(rf"\b(?:(?:one|an?)[ -])?({'|'.join(sorted(_PARTS, key=len, reverse=True))})\b")
_ORDER = re.compile(rf"\b({'|'.join(_ORDERS)})(?:[ -]order)?$")


def digits_for_words(text: str) -> str:
    """Return the text with digits for number words; a text with digits stays as it is."""
    if re.search(r"\d", text):
        return text
    lower = re.sub(r"(?<=\w)fold\b", " fold", text.lower())
    found = _PART.sub(lambda part: f"1/{_PARTS[part[1]]}", lower)
    found = _WHOLE.sub(_whole, found)
    found = _ORDER.sub(lambda order: str(_ORDERS[order[1]]), found)
    return found if found != lower else text


def _whole(words: re.Match[str]) -> str:
    """Return the digits of a whole number such as "two hundred"."""
    number, article = 0, True
    for word in re.split(r"[ -]", words[0]):
        if word in ("hundred", "thousand"):
            number = (number or 1) * (100 if word == "hundred" else 1000)
        else:
            number += _VALUES.get(word, 0)
        article &= word in ("a", "an")
    return words[0] if article else str(number)
