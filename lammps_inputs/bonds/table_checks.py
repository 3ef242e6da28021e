"""The text of a table, and what it says twice: energies, and slopes, against its forces."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import TableError
from chaincor.lammps_inputs.given_numbers import last_digit

# Rounding of numbers that are written with all their digits.
_EPSILON = 1e-14
# What a header may hold, and how many words behind it; of pairs, more.
_SETTINGS = {"N": 1, "FP": 2, "EQ": 1}
_PAIR_SETTINGS = {"N": 1, "EQ": 1, "FPRIME": 2, "FP": 2, "R": 2, "RSQ": 2, "BITMAP": 2}


@dataclass(frozen=True)
class Section:
    """One section of a table, as it stands in a file."""

    keyword: str  #: Its name; empty where the file has none.
    #: What the line ``N rows FP slope slope EQ length`` says, by name.
    header: dict[str, list[float]]
    #: Length or angle, energy and force, and one unit of the last digit of each; of shape (rows,
    #: 3).
    data: Array
    digits: Array  #: See ``data``.

    @cached_property
    def least_digits(self) -> Array:
        """
        One unit of the last digit of each number where formats have left zeros out at its end.

        A column has as many decimals, or as many digits, as the number that shows most of them.
        """
        digits = self.digits
        with np.errstate(divide="ignore"):
            exponents = np.floor(np.log10(np.abs(self.data)))
            size = np.where(self.data == 0.0, digits, 10.0**exponents)
        in_all = size * np.min(digits / size, axis=0)
        return np.minimum(digits, np.maximum(np.min(digits, axis=0), in_all))


def section_text(keyword: str, header: str, columns: Iterable[Array]) -> str:
    """Write a section, of lengths, energies and forces, with all their digits."""
    rows = enumerate(zip(*(column.tolist() for column in columns), strict=True), 1)
    lines = [f"{i} {r:.17g} {e:.17g} {f:.17g}" for i, (r, e, f) in rows]
    return "\n".join([keyword, header, "", *lines, ""])


def sections_of(text: str, path: str, *, pair: bool = False) -> list[Section]:
    """
    Return the sections of a table file; one without a header where there are only rows.

    Raises TableError where a header or a row cannot be read.
    """
    found: list[tuple[str, dict[str, list[float]], list[list[str]]]] = []
    last = ""
    for line in text.splitlines():
        words = line.split("#")[0].split()
        if not words:
            continue
        if len(words) > 1 and words[0] in _PAIR_SETTINGS and "N" in words:
            found.append((last, _header(words, line, path, pair=pair), []))
        elif words[0].isdigit() and len(words) == 4:
            if not found:
                found.append(("", {}, []))
            found[-1][2].append([*words[1:], line])
        last = words[0]
    return [_section(keyword, header, rows, path) for keyword, header, rows in found]


def _header(words: list[str], line: str, path: str, *, pair: bool) -> dict[str, list[float]]:
    settings = _PAIR_SETTINGS if pair else _SETTINGS
    found: dict[str, list[float]] = {}
    try:
        while words:
            name, count = words[0], settings[words[0]]
            found[name] = [float(word) for word in words[1 : 1 + count]]
            if len(found[name]) < count:
                raise ValueError
            words = words[1 + count :]
    except (KeyError, ValueError):
        expected = (
            "'R low high' or 'FP slope slope'" if pair else "'FP slope slope' and 'EQ length'"
        )
        raise TableError(
            f"table {path!r} has the line {line.strip()[:60]!r}; expected "
            f"'N rows', then {expected} if they are known"
        ) from None
    return found


def _section(
    keyword: str, header: dict[str, list[float]], rows: list[list[str]], path: str
) -> Section:
    read, digits = [], []
    for *words, line in rows:
        try:
            read.append([float(word) for word in words])
            digits.append([last_digit(word) for word in words])
        except ValueError:
            raise TableError(
                f"table {path!r} has the row {line.strip()[:60]!r}; expected "
                "'index length energy force'"
            ) from None
    shape = (-1, 3)
    return Section(keyword, header, np.array(read).reshape(shape), np.array(digits).reshape(shape))


@np.errstate(over="ignore", invalid="ignore")
def fault_of_energies(data: Array, digits: Array, path: str, allowed: float = 0.0) -> str:
    """
    Compare the mean force between two rows, by their energies, with the forces around.

    What is wrong is returned, nothing where energies are those of the forces, or all the same.

    A mean lies between the least and the largest force from the row before to the row after. Rows
    as far apart as the bond changes its stiffness in may miss as much as they span again; `allowed`
    is a further difference of force.
    """
    lengths, energies, forces = data.T
    if np.ptp(energies) == 0.0:
        return ""  # there are none
    steps = np.diff(lengths)
    means = -np.diff(energies) / steps
    around = np.lib.stride_tricks.sliding_window_view(np.pad(forces, 1, mode="edge"), 4)
    last = 0.5 * (digits[:-1] + digits[1:])
    steepest = np.max(np.abs(around), axis=1)
    rounding = _EPSILON * (np.abs(energies[:-1]) + np.abs(energies[1:]))
    room = np.ptp(around, axis=1) + last[:, 2] + _EPSILON * steepest
    room += (last[:, 1] + last[:, 0] * steepest + rounding) / steps
    low, high = np.min(around, axis=1) - room, np.max(around, axis=1) + room
    off = np.maximum(low - means, means - high)
    worst = int(np.argmax(off))
    if off[worst] <= allowed:
        return ""
    return (
        f"table {path!r} has energies that fall by {means[worst]:.6g} a length between "
        f"{lengths[worst]:.6g} and {lengths[worst + 1]:.6g}, where its forces are "
        f"{around[worst].min():.6g} to {around[worst].max():.6g}; expected force = -dE/dr: "
        "correct either, or let all energies be 0, as only forces are used"
    )


def fault_of_slopes(section: Section, path: str) -> str:
    """
    Compare FP with the slopes of the first and of the last four rows, and return what is wrong.

    Rows so far apart that these slopes differ by half say nothing of those at the ends.
    """
    given = section.header.get("FP", section.header.get("FPRIME", [0.0, 0.0]))
    # As many write them who know no slopes, LAMMPS's manual too.
    if given == [0.0, 0.0]:
        return ""
    for slope, end, name in (
        (given[0], slice(4), "first"),
        (given[1], slice(None, -5, -1), "last"),
    ):
        lengths, _, forces = section.data[end].T
        slopes = np.diff(forces) / np.diff(lengths)
        bends = np.abs(np.diff(slopes))
        expected = slopes[0] - 0.5 * (slopes[1] - slopes[0])
        step = float(np.min(np.abs(np.diff(lengths))))
        largest = np.max(section.least_digits[end], axis=0)
        steepest = float(np.max(np.abs(slopes)))
        if np.max(bends) > 0.5 * steepest:
            continue
        room = 3.0 * bends[0] + 2.0 * bends[1] + _EPSILON * steepest
        room += 8.0 * (largest[2] + largest[0] * steepest) / step
        if not abs(slope - expected) <= room:
            return (
                f"table {path!r} says FP {given[0]:g} {given[1]:g}, and its forces change by "
                f"{expected:.6g} a length at the {name} row; expected dF/dr there: correct FP, or "
                "leave it out, as it is not used"
            )
    return ""
