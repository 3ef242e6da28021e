"""Number of printed digits in an extended XYZ file."""

from itertools import islice
from pathlib import Path

# A file has at least the six digits of the default format ``%g``.
_LEAST_DIGITS = 6
# float64 has at most this many digits.
_MOST_DIGITS = 17
# A header with a larger number of atoms is damaged.
_MOST_PARTICLES = 10**9


def printed_digits(path: Path) -> tuple[int, int | None]:
    """
    Return how many significant digits and decimals the numbers of an extended XYZ file have.

    The second result is None if not all numbers have equally many decimals: ``%g`` drops trailing
    zeros, and ``%.8f`` keeps them. All frames are examined, because the first frame of a chain may
    have round numbers. Damaged lines are ignored.
    """
    digits, decimals = _LEAST_DIGITS, set()
    with path.open("rb") as file:
        while head := file.readline():
            particles = int(head) if head.strip().isdigit() and len(head) < 12 else 0
            file.readline()
            for line in islice(file, min(particles, _MOST_PARTICLES)):
                for word in line.split()[1:]:
                    mantissa, _, exponent = word.lower().partition(b"e")
                    if exponent or b"." in mantissa:
                        shown = mantissa.lstrip(b"+-").replace(b".", b"").lstrip(b"0")
                        digits = max(digits, len(shown))
                        decimals.add(None if exponent else len(mantissa.partition(b".")[2]))
                    elif mantissa.lstrip(b"+-").isdigit():
                        decimals.add(0)
    fixed = decimals.pop() if len(decimals) == 1 else None
    if fixed == 0:
        fixed = None
    return (_MOST_DIGITS if fixed is not None else min(digits, _MOST_DIGITS)), fixed
