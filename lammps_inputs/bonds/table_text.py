"""Read and write sections of LAMMPS table files: headers, rows and their digits."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import TableError
from chaincor.lammps_inputs.given_numbers import last_digit

# Words of a header line, each with the number of values that follow.
BOND_SETTINGS = {"N": 1, "FP": 2, "EQ": 1}
SETTINGS = BOND_SETTINGS | {
    "FPRIME": 2,
    "R": 2,
    "RSQ": 2,
    "BITMAP": 2,
    "NOF": 0,
    "DEGREES": 0,
    "RADIANS": 0,
    "degrees": 0,
    "radians": 0,
    "CHECKU": 1,
    "CHECKF": 1,
}
_TEXT = ("CHECKU", "CHECKF")
# A header may have at most one word of each of these groups.
_EXCLUSIVE = (("R", "RSQ", "BITMAP"), ("DEGREES", "RADIANS"))


@dataclass(frozen=True)
class Section:
    """Section of a table file."""

    keyword: str  #: Name of the section; empty if it has no name.
    #: Values of the line ``N rows FP slope slope EQ length``, by name.
    header: dict[str, list[float]]
    #: Length or angle, energy and force, of shape (rows, 3); NaN if the file has no forces.
    data: Array
    digits: Array  #: One unit in the last digit of each number in `data`.
    #: Whether there is a line without numbers between header and rows.
    is_parted: bool = True
    #: Lines before or between the rows that are not rows.
    odd_lines: tuple[str, ...] = field(default=())
    #: Line after the header that LAMMPS skips in place of the empty line.
    skipped: str = ""
    #: Words that occur twice in the header, or that exclude each other, as text.
    repeated: tuple[str, ...] = field(default=())
    #: Last line before the keyword, if it belongs to no section.
    unread: str = ""

    @cached_property
    def least_digits(self) -> Array:
        """
        One unit of the last digit of each number, even if the format omits trailing zeros.

        The number of decimals, or of digits, in a column is that of its longest number.
        """
        digits = self.digits
        with np.errstate(divide="ignore", invalid="ignore"):
            exponents = np.floor(np.log10(np.abs(self.data)))
            size = np.where(self.data == 0.0, digits, 10.0**exponents)
            in_all = size * np.min(digits / size, axis=0)
        return np.minimum(digits, np.maximum(np.min(digits, axis=0), in_all))


def section_text(keyword: str, header: str, columns: Iterable[Array]) -> str:
    """Write a section with all digits of its lengths, energies and forces."""
    rows = enumerate(zip(*(column.tolist() for column in columns), strict=True), 1)
    lines = [f"{i} {r:.17g} {e:.17g} {f:.17g}" for i, (r, e, f) in rows]
    return "\n".join([keyword, header, "", *lines, ""])


@dataclass
class _Draft:
    """Section that is being read."""

    keyword: str
    header: dict[str, list[float]]
    repeated: tuple[str, ...] = ()
    unread: str = ""
    rows: list[list[str]] = field(default_factory=list)
    is_parted: bool = False
    odd: list[str] = field(default_factory=list)
    skipped: str = ""
    #: Lines without numbers after the rows so far; if further rows follow, these lines become odd
    #: lines.
    pending: list[str] = field(default_factory=list)

    def add_row(self, row: list[str]) -> None:
        self.rows.append(row)
        self.odd += self.pending
        self.pending.clear()

    def add_words(self, line: str) -> None:
        """Record a line that is neither a row nor the header of a section."""
        if _is_number(line.split()[0]):
            self.odd.append(line)
        elif self.rows or self.is_parted or not self.header:
            self.pending.append(line)
        else:
            self.skipped, self.is_parted = line, True


def sections_of(text: str, path: str, settings: dict[str, int] = BOND_SETTINGS) -> list[Section]:
    """
    Return the sections of a table file; a file with only rows is one section without a header.

    `settings` are the words that a header may contain, with the number of values after each. Raises
    TableError if a header or a row cannot be read.
    """
    found: list[_Draft] = []
    last, is_after_header = "", False
    strays: list[str] = []
    for line in text.splitlines():
        words = line.split("#")[0].split()
        if not words:
            # LAMMPS skips the line between header and rows; here this line is empty or a comment.
            if found and not found[-1].rows:
                found[-1].is_parted = True
            continue
        columns = 3 if found and "NOF" in found[-1].header else 4
        is_header = len(words) > 1 and words[0] in SETTINGS and "N" in words
        # A header line right after another header line does not begin a section.
        if is_header and not is_after_header:
            unread = strays[-2] if len(strays) > 1 else ""
            found.append(_Draft(last, *_header(words, line, path, settings), unread))
            strays = []
        elif words[0].isdigit() and len(words) >= columns:
            if not found:
                found.append(_Draft("", {}))
            numbers = words[1:columns]
            found[-1].add_row([*numbers, *["nan"] * (3 - len(numbers)), line])
            strays = []
        else:
            strays.append(line.strip())
            if found and (len(words) > 1 or not _is_number(words[0])):
                found[-1].add_words(line.strip())
        last, is_after_header = words[0], is_header
    return [_section(draft, path) for draft in found]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _header(
    words: list[str], line: str, path: str, settings: dict[str, int]
) -> tuple[dict[str, list[float]], tuple[str, ...]]:
    """Return the numbers after each keyword of a header, and the keywords that LAMMPS ignores."""
    found: dict[str, list[float]] = {}
    repeated: list[str] = []
    said = f"table {path!r} has the line {line.strip()[:60]!r}"
    try:
        while words:
            name, count = words[0], settings[words[0]]
            values = words[1 : 1 + count]
            if len(values) < count:
                raise ValueError
            if name == "N" and not values[0].isdigit():
                raise TableError(f"{said}. Write the number of rows as a whole number")
            repeated += [
                f"{other} twice" if other == name else f"{other} and {name}"
                for other in found
                if other in _rivals(name)
            ]
            found[name.upper()] = [] if name in _TEXT else [float(word) for word in values]
            words = words[1 + count :]
    except (KeyError, ValueError):
        expected = (
            "'FP slope slope' and 'EQ length'"
            if settings is BOND_SETTINGS
            else "'R low high' or 'FP slope slope'"
        )
        raise TableError(f"{said}. Write 'N rows', then {expected} if they are known") from None
    return found, tuple(dict.fromkeys(repeated))


def _rivals(name: str) -> tuple[str, ...]:
    """Return the earlier words of a header that LAMMPS ignores because of this word."""
    name = name.upper()
    return next((group for group in _EXCLUSIVE if name in group), (name,))


def _section(draft: _Draft, path: str) -> Section:
    read, digits = [], []
    for *words, line in draft.rows:
        try:
            read.append([float(word) for word in words])
            digits.append([0.0 if word == "nan" else last_digit(word) for word in words])
        except ValueError:
            raise TableError(
                f"table {path!r} has the row {line.strip()[:60]!r}. Write 'index length energy "
                "force' in each row"
            ) from None
    shape = (-1, 3)
    return Section(
        draft.keyword,
        draft.header,
        np.array(read).reshape(shape),
        np.array(digits).reshape(shape),
        draft.is_parted,
        tuple(draft.odd),
        draft.skipped,
        draft.repeated,
        draft.unread,
    )
