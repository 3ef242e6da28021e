"""Bond tables for LAMMPS bond_style table: sampling a potential, and writing it."""

import math
from dataclasses import dataclass, replace

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.table_checks import section_text
from chaincor.lammps_inputs.errors import TableError
from chaincor.lammps_inputs.scene_parts.field_types import TableStyle
from chaincor.lammps_inputs.table_span import (
    FEWEST_ROWS,
    FORCE_TARGET,
    choose_rows,
    rows_on_kinks,
    with_margin,
)
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
    force_error: float | None = None,
) -> BondTable:
    """
    Sample a potential in one table, or in two where some bonds get very long.

    The two overlap around ``FAR_BACK`` to ``FAR_OUT`` and have equally many rows, because LAMMPS
    interpolates all types on equally many.
    """
    shortest, longest = bond_range
    if longest <= NEAR_END + 1.0:
        return tabulate(bond, bond_range, style, force_error=force_error)
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
