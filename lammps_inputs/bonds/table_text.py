"""Read and write sections of LAMMPS table files: headers, rows and their digits."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import TableError
from chaincor.lammps_inputs.given_numbers import last_digit

# A header line may have these words, each followed by this many values.
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


@dataclass(frozen=True)
class Section:
    """One section of a table file."""

    keyword: str  #: Name of the section; empty without a name.
    #: Values of the line ``N rows FP slope slope EQ length``, by name.
    header: dict[str, list[float]]
    #: Length or angle, energy and force (NaN if the file has none), and one unit of the last digit
    #: of each; of shape (rows, 3).
    data: Array
    digits: Array  #: See ``data``.
    #: Whether a line without numbers is between header and rows.
    is_parted: bool = True
    #: Lines between the rows that hold numbers but are no rows.
    odd_lines: tuple[str, ...] = field(default=())

    @cached_property
    def least_digits(self) -> Array:
        """
        One unit of the last digit of each number, for formats that omit trailing zeros.

        The decimals, or digits, of a column are those of its longest number.
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
    rows: list[list[str]] = field(default_factory=list)
    is_parted: bool = False
    odd: list[str] = field(default_factory=list)


def sections_of(text: str, path: str, settings: dict[str, int] = BOND_SETTINGS) -> list[Section]:
    """
    Return the sections of a table file; a file of rows alone is one section without a header.

    `settings` are the words that a header may hold, with the number of values behind each. Raises
    TableError if a header or a row cannot be read.
    """
    found: list[_Draft] = []
    last = ""
    for line in text.splitlines():
        words = line.split("#")[0].split()
        if not words:
            # LAMMPS skips this one line, whatever it holds.
            if found and not found[-1].rows:
                found[-1].is_parted = True
            continue
        columns = 3 if found and "NOF" in found[-1].header else 4
        if len(words) > 1 and words[0] in SETTINGS and "N" in words:
            found.append(_Draft(last, _header(words, line, path, settings)))
        elif words[0].isdigit() and len(words) >= columns:
            if not found:
                found.append(_Draft("", {}))
            numbers = words[1:columns]
            found[-1].rows.append([*numbers, *["nan"] * (3 - len(numbers)), line])
        elif found and len(words) > 1 and _is_number(words[0]):
            found[-1].odd.append(line.strip())
        last = words[0]
    return [_section(draft, path) for draft in found]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _header(
    words: list[str], line: str, path: str, settings: dict[str, int]
) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {}
    try:
        while words:
            name, count = words[0], settings[words[0]]
            values = words[1 : 1 + count]
            found[name.upper()] = [] if name in _TEXT else [float(word) for word in values]
            if len(values) < count:
                raise ValueError
            words = words[1 + count :]
    except (KeyError, ValueError):
        expected = (
            "'FP slope slope' and 'EQ length'"
            if settings is BOND_SETTINGS
            else "'R low high' or 'FP slope slope'"
        )
        raise TableError(
            f"table {path!r} has the line {line.strip()[:60]!r}. Write 'N rows', then "
            f"{expected} if they are known"
        ) from None
    return found


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
    )
