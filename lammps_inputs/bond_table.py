"""Bond tables for LAMMPS bond_style table: how far and how fine a potential is sampled."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.interpolation import interpolate
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.table_text import section_text
from chaincor.lammps_inputs.errors import TableError
from chaincor.lammps_inputs.scene_parts.scene_fields import TableStyle
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem

# Sections of the table file, one for each bond type.
KEYWORDS = ("CHAIN", "FAR")

# A chain that breaks stretches some bonds far beyond all others. A second table takes over there,
# so that the first, whose end at short lengths is steep, stays narrow. A bond changes over where
# both tables hold it, out at one length and back at a shorter one.
FAR_OUT = 2.1
FAR_BACK = 1.9
NEAR_END = FAR_OUT + 0.25
FAR_START = FAR_BACK - 0.25

# LAMMPS reads past the end of a spline table within one bin of it; stay three bins inside.
MARGIN_BINS = 3
# A scouting run sees bonds at the ends of its steps: at H = 0.4 and a frequency of 2 it misses up
# to 1 - cos(0.4) = 8 % of an extreme. A job run by `lmp` alone cannot widen its table.
MARGIN_FRACTION = 0.1

# A row takes LAMMPS about 1 us to read, so rows cost as much as integration from here on.
MOST_ROWS = 200_000
FEWEST_ROWS = 201
# Force error a table is given rows for, relative to the largest force in its range. Rounding in
# LAMMPS's own interpolation stops at about 2e-13.
FORCE_TARGET = {"spline": 3e-13, "linear": 1e-9}
_ERROR_ORDER = {"spline": 4, "linear": 2}
_PROBE_ROWS = 2001
# How much finer than asked rows may get so that they lie on all kinks.
_FINER = 0.8


@dataclass(frozen=True)
class BondTable:
    """A bond potential sampled uniformly in length."""

    #: r, U(r) and -dU/dr; of shape (rows,).
    lengths: Array
    energies: Array  #: See ``lengths``.
    forces: Array  #: See ``lengths``.
    #: d(force)/dr at the first and the last row: what LAMMPS calls FP.
    edge_slopes: tuple[float, float]
    style: TableStyle  #: ``linear`` or ``spline``.
    #: A second table of as many rows, which takes over for very long bonds.
    far: "BondTable | None" = None

    @property
    def longest(self) -> float:
        """Longest bond that can be held."""
        return float((self.far or self).lengths[-1])

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.lengths)

    @property
    def spacing(self) -> float:
        """Distance between rows."""
        return float((self.lengths[-1] - self.lengths[0]) / (self.rows - 1))

    def to_text(self, units: UnitSystem = CHAIN_UNITS) -> str:
        """Format the table as LAMMPS reads it: 17 significant digits, a section a bond type."""
        text = self._section(KEYWORDS[0], units)
        return text if self.far is None else text + "\n" + self.far._section(KEYWORDS[1], units)

    def _section(self, keyword: str, units: UnitSystem) -> str:
        low, high = (units.stiffness * slope for slope in self.edge_slopes)
        header = f"N {self.rows} FP {low:.17g} {high:.17g} EQ {units.length!r}"
        columns = (
            units.length * self.lengths,
            units.energy * self.energies,
            units.force * self.forces,
        )
        title = "# bond potential of the chain: row, length, energy, force = -dU/dr\n\n"
        return title + section_text(keyword, header, columns)


def tabulate(
    bond: Potential,
    bond_range: tuple[float, float],
    style: TableStyle = "spline",
    rows: int | None = None,
    force_error: float | None = None,
) -> BondTable:
    """
    Sample a potential over the bond lengths that will be met, and a margin beyond.

    Without `rows` there are as many as the force needs (`choose_rows`), up to `force_error`.
    Raises TableError if the range is empty, too few rows leave no margin, or bonds get so short
    that their force is no number.
    """
    shortest, longest = bond_range
    if not (0.0 <= shortest <= longest < math.inf):
        raise TableError(
            f"the bond range is {shortest:g} to {longest:g}; expected two finite lengths in order"
        )
    if rows is None:
        span = with_margin(bond, bond_range, FEWEST_ROWS)
        rows = choose_rows(bond, span, style, force_error)
    low, high = rows_on_kinks(bond, with_margin(bond, bond_range, rows), rows)
    lengths = np.linspace(low, high, rows)
    strains = lengths - 1.0
    slopes = -bond.curvature(strains[[0, -1]])
    return BondTable(
        lengths=lengths,
        energies=bond.energy(strains),
        forces=bond.force(strains),
        edge_slopes=(float(slopes[0]), float(slopes[1])),
        style=style,
    )


def tabulate_near_and_far(
    bond: Potential,
    bond_range: tuple[float, float],
    style: TableStyle = "spline",
    rows: int | None = None,
    force_error: float | None = None,
) -> BondTable:
    """
    Sample a potential in one table, or, without `rows`, in two where some bonds get very long.

    The two overlap around ``FAR_BACK`` to ``FAR_OUT`` and have equally many rows, because LAMMPS
    interpolates all types on equally many.
    """
    shortest, longest = bond_range
    if rows is not None or longest <= NEAR_END + 1.0:
        return tabulate(bond, bond_range, style, rows, force_error)
    if force_error is None:
        # What the near table reaches; the far one, with its small forces, need do no better.
        force_error = FORCE_TARGET[style] * abs(float(bond.force(shortest - 1.0)))
    ranges = ((shortest, NEAR_END), (FAR_START, longest))
    rows = max(
        choose_rows(bond, with_margin(bond, part, FEWEST_ROWS), style, force_error)
        for part in ranges
    )
    near, far = (tabulate(bond, part, style, rows) for part in ranges)
    return replace(near, far=far)


def with_margin(bond: Potential, bond_range: tuple[float, float], rows: int) -> tuple[float, float]:
    """
    Return the lengths a table of so many rows goes to, beyond those that will be met.

    Raises TableError where rows are too few, or the force has no number at the shorter end.
    """
    shortest, longest = bond_range
    bins = rows - 1
    if bins <= 2 * MARGIN_BINS:
        raise TableError(
            f"table_points is {rows}; expected at least {2 * MARGIN_BINS + 2}, so that the bonds "
            "stay clear of the table's ends"
        )
    # Each end moves out by a fraction of its own distance from rest: a long tail must not carry
    # the steep end along. Absolute coordinates are rounded: nothing narrower than 1e-9 is real.
    low = shortest - max(MARGIN_FRACTION * abs(1.0 - shortest), 1e-9)
    # A bond that is never stretched, between two particles, still trembles about its rest.
    high = longest + max(MARGIN_FRACTION * max(longest - 1.0, 0.2 * (1.0 - shortest)), 1e-9)
    # And by some bins, whose width grows with the range they widen; one more where the rows are
    # moved until they lie on kinks.
    margin_bins = MARGIN_BINS + bool(bond.kinks)
    margin = margin_bins * (high - low) / max(bins - 2 * margin_bins, 1)
    low, high = low - margin, high + margin
    floor = 1.0 + bond.strain_min if math.isfinite(bond.strain_min) else 0.0
    if low <= floor:
        low = floor + 0.5 * (shortest - floor)
    ceiling = 1.0 + bond.strain_max
    if high >= ceiling:
        high = ceiling - max(0.5 * (ceiling - longest), 1e-9)
    with np.errstate(all="ignore"):
        steepest = float(bond.curvature(low - 1.0))
    if not math.isfinite(steepest):
        raise TableError(
            f"bonds would get as short as {shortest:.3g}, where a {bond.name} bond has no finite "
            "stiffness; expected bonds that a table can hold: lower the speed, or use engine "
            "'reference'"
        )
    return low, high


def rows_on_kinks(bond: Potential, span: tuple[float, float], rows: int) -> tuple[float, float]:
    """
    Move the ends of a table, by a row at most, until rows lie on the kinks of a bond.

    LAMMPS interpolates linearly between uniform rows: with a kink on a row it is kept, and
    between two rows it is cut off.

    Kinks outside the span do not matter. One or two lie on rows to rounding; of more, the first and
    the last do, and the others as nearly as a spacing can be found for.
    """
    low, high = span
    inside = [1.0 + kink for kink in bond.kinks if low < 1.0 + kink < high]
    floor, ceiling = 1.0 + bond.strain_min, 1.0 + bond.strain_max
    if not inside:
        return span
    spacing = (high - low) / (rows - 1)
    first, last = inside[0], inside[-1]
    most = int((last - first) / spacing)
    if most > 0:
        # Fewer bins between the kinks are wider ones: the table may only get longer.
        counts = np.arange(most, max(int(_FINER * most), 1) - 1, -1)
        steps = (last - first) / counts
        offsets = (np.array(inside) - first) / steps[:, None]
        best = int(np.argmin(np.max(np.abs(offsets - np.round(offsets)), axis=1).round(9)))
        spacing = float(steps[best])
    below = round((first - low) / spacing)
    below -= first - below * spacing <= floor
    below += first + (rows - 1 - below) * spacing >= ceiling
    start = first - below * spacing
    return start, start + (rows - 1) * spacing


def choose_rows(
    bond: Potential,
    span: tuple[float, float],
    style: TableStyle,
    force_error: float | None = None,
) -> int:
    """
    Return how many rows bring the interpolated force to its target error.

    The error of a probe with few rows is measured between its rows and scaled with the order of
    the interpolation (4 for the cubic spline, 2 for the straight line).

    `force_error` is the largest wanted; None: ``FORCE_TARGET`` of the largest force in the range.
    There are at most ``MOST_ROWS``.
    """
    ends = [span[0], *(1.0 + k for k in bond.kinks if span[0] < 1.0 + k < span[1]), span[1]]
    # Kinks lie on rows: what counts is the force between them.
    parts = [_probe(bond, part, style) for part in pairwise(ends)]
    scale = max(size for _, size in parts)
    target = FORCE_TARGET[style] * scale
    if force_error is not None:
        target = max(target, force_error)
    needed = max(
        (span[1] - span[0])
        / (high - low)
        * _PROBE_ROWS
        * (error / max(target, 1e-300)) ** (1.0 / _ERROR_ORDER[style])
        for (low, high), (error, _) in zip(pairwise(ends), parts, strict=True)
    )
    return int(min(max(needed, FEWEST_ROWS), MOST_ROWS))


def _probe(bond: Potential, span: tuple[float, float], style: TableStyle) -> tuple[float, float]:
    """Return the error of the interpolated force with few rows, and the largest force."""
    lengths = np.linspace(*span, _PROBE_ROWS)
    middles = 0.5 * (lengths[1:] + lengths[:-1])
    forces = bond.force(lengths - 1.0)
    low, high = -bond.curvature(lengths[[0, -1]] - 1.0)
    between = interpolate(style, lengths, forces, (low, high), middles)
    error = float(np.max(np.abs(between - bond.force(middles - 1.0))))
    return error, float(np.max(np.abs(forces)))
