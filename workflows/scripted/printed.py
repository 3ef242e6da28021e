"""What a finished script has printed, read back from its log."""

import contextlib
import math
import re
from collections.abc import Iterable

_NUMBER = r"([-+.\deE]+|null|[-+]?(?:nan|inf))"


def printed_numbers(log: str, names: Iterable[str]) -> dict[str, float]:
    """
    Return, by name, the numbers of lines such as ``restitution = 0.9``, the last of each.

    ``null``, which scripts print for what they do not know, is nan; what is no number is left out.
    """
    found: dict[str, float] = {}
    for name in names:
        said = re.findall(rf"^\s*{re.escape(name)} = {_NUMBER}\s*$", log, re.MULTILINE)
        with contextlib.suppress(ValueError):
            if said:
                found[name] = math.nan if said[-1] == "null" else float(said[-1])
    return found
