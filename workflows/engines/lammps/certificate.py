"""Measure the errors of a bond table that LAMMPS interpolates."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bond_table import MARGIN_BINS, BondTable
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.lammps.instance import LammpsChain

_FILE = "certificate.table"
_MOST_LENGTHS = 4001
_ROWS_AT_KINK, _LENGTHS_AT_KINK = 4, 66


@dataclass(frozen=True)
class TableCertificate:
    """Largest differences between a bond table, interpolated by LAMMPS, and the potential."""

    style: str  #: ``linear`` or ``spline``.
    rows: int  #: Number of rows in the table; the far table, if there is one, has the same number.
    #: First bond length of the table.
    shortest: float
    longest: float  #: Last bond length of the table.
    #: Largest ``|LAMMPS - analytic|`` of the force, away from the ends of the table.
    force_error: float
    #: Largest ``|LAMMPS - analytic|`` of the energy, away from the ends of the table.
    energy_error: float
    #: Largest error of the force within a margin at either end of the table. In an accepted run, no
    #: bond length lies within these margins.
    edge_force_error: float
    edge_energy_error: float  #: Largest error of the energy within these margins.
    lengths_asked: int  #: Number of bond lengths at which LAMMPS and the potential are compared.


def certify_table(chain: LammpsChain, table: BondTable, bond: Potential) -> TableCertificate:
    """
    Return the largest errors of LAMMPS's interpolation between the rows of a table.

    A constant difference between the energies is not an error.
    """
    parts = [_largest_errors(chain, 1, table, bond)]
    if table.far is not None:
        parts.append(_largest_errors(chain, 2, table.far, bond))
    force, energy, edge_force, edge_energy = np.max(parts, axis=0).tolist()
    return TableCertificate(
        style=table.style,
        rows=table.rows,
        shortest=float(table.lengths[0]),
        longest=table.longest,
        force_error=force,
        energy_error=energy,
        edge_force_error=edge_force,
        edge_energy_error=edge_energy,
        lengths_asked=_lengths_asked(table) * len(parts),
    )


def _lengths_asked(table: BondTable) -> int:
    # The lengths must lie between the rows, at which the table is exact. Twice as many lengths as
    # rows lie at all distances from the rows.
    return min(2 * table.rows, _MOST_LENGTHS)


def _largest_errors(
    chain: LammpsChain, bond_type: int, table: BondTable, bond: Potential
) -> list[float]:
    """Return the largest errors of force and energy, first away from the ends, then at the ends."""
    first, last = float(table.lengths[0]), float(table.lengths[-1])
    inset, margin = 0.25 * table.spacing, MARGIN_BINS * table.spacing
    everywhere = (first + inset, last - inset, last - first - 2 * inset)
    parts = [_errors(chain, bond_type, bond, everywhere, _lengths_asked(table))]
    # A kink affects only a few rows of the table, and the lengths above may miss these rows.
    near = _ROWS_AT_KINK * table.spacing
    for kink in bond.kinks:
        low, high = max(1.0 + kink - near, first + inset), min(1.0 + kink + near, last - inset)
        if low < high:
            parts.append(_errors(chain, bond_type, bond, (low, high, high - low), _LENGTHS_AT_KINK))
    lengths, *errors = np.concatenate(parts, axis=1)
    inside = (lengths > first + margin) & (lengths < last - margin)
    return [float(np.max(e[at], initial=0.0)) for at in (inside, ~inside) for e in errors]


def _errors(
    chain: LammpsChain,
    bond_type: int,
    bond: Potential,
    span: tuple[float, float, float],
    asked: int,
) -> NDArray[np.float64]:
    """Return equally spaced lengths in an interval, and the errors of force and energy there."""
    first, last, width = span
    file = chain.folder / _FILE
    chain.commands(
        f'bond_write {bond_type} {asked} {first!r} {last!r} "{file.as_posix()}" CERTIFICATE'
    )
    rows = [line.split() for line in file.read_text().splitlines()]
    file.unlink()
    data = np.array([row for row in rows if len(row) == 4 and row[0].isdigit()], dtype=float)
    _, _, energies, forces = data.T
    # LAMMPS rounds lengths to 15 digits in its file, but evaluates the table at unrounded lengths.
    lengths = first + width / (asked - 1) * np.arange(asked)
    strains = lengths - 1.0
    return np.array(
        [lengths, np.abs(forces - bond.force(strains)), np.abs(energies - bond.energy(strains))]
    )
