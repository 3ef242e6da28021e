"""Choose the range and the spacing of bond tables for LAMMPS's bond_style table."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.equilibrium import kept_by_bond
from chaincor.lammps_inputs.bonds.interpolation import interpolate
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.table_text import section_text
from chaincor.lammps_inputs.errors import TableError
from chaincor.lammps_inputs.scene_parts.scene_fields import TableStyle
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem

# Names of the sections of a table file, one for each bond type.
KEYWORDS = ("CHAIN", "FAR")

# If a chain breaks, some bonds become much longer than all others. A second table for these lengths
# keeps the first table narrow, which is steep at short lengths. A bond switches to the far table at
# the length FAR_OUT, and back at the shorter length FAR_BACK. The two tables overlap between these
# lengths.
FAR_OUT = 2.1
FAR_BACK = 1.9
NEAR_END = FAR_OUT + 0.25
FAR_START = FAR_BACK - 0.25

# If a bond is closer than one bin to the end of a spline table, LAMMPS reads beyond the table. The
# margin keeps bonds three bins away from the end.
MARGIN_BINS = 3
# Margin of a table, as a fraction of the strain at its end. A pilot run samples bonds only at the
# ends of steps. At H = 0.4 and a frequency of 2 it misses up to 1 - cos(0.4) = 8 % of an extreme
# strain. A script that runs in `lmp` alone cannot widen its table later.
MARGIN_FRACTION = 0.1

# LAMMPS reads a row in about 1 us. Reading more rows would take as long as the integration.
MOST_ROWS = 200_000
FEWEST_ROWS = 201
# Target error of the tabulated force, relative to the largest force in the table. Because of
# rounding in LAMMPS's interpolation, the error is at least about 2e-13.
FORCE_TARGET = {"spline": 3e-13, "linear": 1e-9}
_ERROR_ORDER = {"spline": 4, "linear": 2}
_PROBE_ROWS = 2001
# To place rows on all kinks, the number of bins between kinks is reduced at most to this fraction.
_FINER = 0.8


@dataclass(frozen=True)
class BondTable:
    """Bond potential at evenly spaced lengths."""

    #: Bond lengths r of the rows, of shape (rows,).
    lengths: Array
    energies: Array  #: Energies U(r), of shape (rows,).
    forces: Array  #: Forces -dU/dr, of shape (rows,).
    #: Slopes d(force)/dr at the first and the last row, which LAMMPS calls FP.
    edge_slopes: tuple[float, float]
    style: TableStyle  #: Interpolation: ``linear`` or ``spline``.
    #: Second table with an equal number of rows, for very long bonds; None if no bond is so long.
    far: "BondTable | None" = None

    @property
    def longest(self) -> float:
        """Longest bond in the range of the tables."""
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
        """Format the table for LAMMPS: 17 significant digits, one section for each bond type."""
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
    Sample a potential over the expected bond lengths, with a margin.

    Without `rows`, `choose_rows` finds the number of rows for `force_error`. Raises TableError if
    the range is empty, if there are too few rows for a margin, or if the shortest bonds have no
    finite force.
    """
    shortest, longest = bond_range
    if not (0.0 <= shortest <= longest < math.inf):
        raise TableError(
            f"the bond range is {shortest:g} to {longest:g}. Give two finite lengths in "
            "increasing order"
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
    Sample a potential in one table, or in two if some bonds become very long.

    With `rows`, there is always one table. Two tables overlap between ``FAR_BACK`` and ``FAR_OUT``.
    They have the same number of rows, because LAMMPS uses one number of rows for all bond types.
    """
    shortest, longest = bond_range
    if rows is not None or longest <= NEAR_END + 1.0:
        return tabulate(bond, bond_range, style, rows, force_error)
    if force_error is None:
        # Allow the usual force error of the near table in both tables; the forces in the far table
        # are small.
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
    Return the ends of a table with `rows` rows and a margin beyond the bond lengths.

    Raises TableError if there are too few rows, or if the force is not finite at the short end.
    """
    shortest, longest = bond_range
    bins = rows - 1
    if bins <= 2 * MARGIN_BINS:
        raise TableError(
            f"table_points is {rows}. Give at least {2 * MARGIN_BINS + 2}, so that no bond "
            "reaches the end of the table"
        )
    # The margin at each end is a fraction of the strain at this end. A long table then has no
    # larger margin at its steep end. The margin is at least 1e-9, because absolute coordinates are
    # rounded.
    low = shortest - max(MARGIN_FRACTION * abs(1.0 - shortest), 1e-9)
    # Rounding slightly stretches even a bond that is only compressed.
    high = longest + max(MARGIN_FRACTION * max(longest - 1.0, 0.2 * (1.0 - shortest)), 1e-9)
    # Each margin also contains MARGIN_BINS bins, whose width grows with the range, and one more bin
    # if rows are moved onto kinks.
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
            f"bonds would get as short as {shortest:.3g}, where a {bond.name} bond has no "
            "finite stiffness. Lower the speed, or use engine 'reference'"
        )
    return low, high


def rows_on_kinks(bond: Potential, span: tuple[float, float], rows: int) -> tuple[float, float]:
    """
    Move the ends of a table by at most one row, to place rows on the kinks of a bond.

    LAMMPS interpolates linearly between evenly spaced rows. A kink on a row is represented exactly,
    and a kink between two rows is cut off.

    Kinks outside the table are ignored. One or two kinks are placed on rows up to rounding. If
    there are more kinks, the first and the last are placed on rows, and all others as close to rows
    as the spacing allows.
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
        # Try fewer bins between the first and the last kink. The bins are then wider, and the table
        # can only become longer.
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
    Return the number of rows at which the interpolated force reaches its target error.

    The interpolation error is measured half-way between the rows of a small table. It is then
    scaled to more rows with its order, 4 for the cubic spline and 2 for straight lines.

    `force_error` is the target error, by default ``FORCE_TARGET`` times the largest force in the
    range. The result is at most ``MOST_ROWS``.
    """
    ends = [span[0], *(1.0 + k for k in bond.kinks if span[0] < 1.0 + k < span[1]), span[1]]
    # Measure the error only between kinks, because the kinks are on rows.
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


@kept_by_bond
def _probe(bond: Potential, span: tuple[float, float], style: TableStyle) -> tuple[float, float]:
    """Return the error of the interpolated force in a small table, and the largest force."""
    lengths = np.linspace(*span, _PROBE_ROWS)
    middles = 0.5 * (lengths[1:] + lengths[:-1])
    forces = bond.force(lengths - 1.0)
    low, high = -bond.curvature(lengths[[0, -1]] - 1.0)
    between = interpolate(style, lengths, forces, (low, high), middles)
    error = float(np.max(np.abs(between - bond.force(middles - 1.0))))
    return error, float(np.max(np.abs(forces)))
