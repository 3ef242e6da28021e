"""What LAMMPS makes of a bond table, read back from LAMMPS and compared with the potential."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from lammps_inputs.bond_table import MARGIN_BINS, BondTable
from lammps_inputs.potential import Potential
from workflows.engines.lammps_chain import LammpsChain

_FILE = "certificate.table"
_MOST_LENGTHS = 4001


@dataclass(frozen=True)
class TableCertificate:
    """
    Largest errors of a bond table as LAMMPS interpolates it.

    Attributes
    ----------
    style : str
        ``linear`` or ``spline``.
    rows : int
        Rows of the table, and of the far one where there are two.
    shortest, longest : float
        First and last bond length of the table.
    force_error, energy_error : float
        Largest ``|LAMMPS - analytic|`` over the lengths asked, away from the ends.
    edge_force_error, edge_energy_error : float
        The same within the margin at both ends, where no bond of an accepted run has been.
    lengths_asked : int
        How many lengths were compared.
    """

    style: str
    rows: int
    shortest: float
    longest: float
    force_error: float
    energy_error: float
    edge_force_error: float
    edge_energy_error: float
    lengths_asked: int

    def to_dict(self) -> dict[str, Any]:
        """
        Return the fields.

        Returns
        -------
        dict
            Names and values.
        """
        return asdict(self)


def certify_table(chain: LammpsChain, table: BondTable, bond: Potential) -> TableCertificate:
    """
    Ask LAMMPS for energies and forces between the rows and compare them with the potential.

    Parameters
    ----------
    chain : LammpsChain
        A chain that has read the table.
    table : BondTable
        The table.
    bond : Potential
        What it stands for.

    Returns
    -------
    TableCertificate
        The largest errors; those of an energy carry no constant.
    """
    near = _largest_errors(chain, 1, table, bond)
    parts = [near] if table.far is None else [near, _largest_errors(chain, 2, table.far, bond)]
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
    # An even number of intervals that shares no factor with the rows falls between them.
    return min(2 * table.rows, _MOST_LENGTHS)


def _largest_errors(
    chain: LammpsChain, bond_type: int, table: BondTable, bond: Potential
) -> tuple[float, float, float, float]:
    """Return the errors of force and energy inside, and the same at the edges."""
    asked = _lengths_asked(table)
    first, last = float(table.lengths[0]), float(table.lengths[-1])
    inset = 0.25 * table.spacing
    file = chain.folder / _FILE
    chain.commands(
        f"bond_write {bond_type} {asked} {first + inset!r} {last - inset!r} "
        f'"{file.as_posix()}" CERTIFICATE'
    )
    rows = [line.split() for line in file.read_text().splitlines()]
    file.unlink()
    data = np.array([row for row in rows if len(row) == 4 and row[0].isdigit()], dtype=float)
    _, _, energies, forces = data.T
    # The file rounds lengths to 15 digits; LAMMPS itself used these.
    lengths = (first + inset) + (last - first - 2 * inset) / (asked - 1) * np.arange(asked)
    strains = lengths - 1.0
    margin = MARGIN_BINS * table.spacing
    inside = (lengths > first + margin) & (lengths < last - margin)
    errors = (np.abs(forces - bond.force(strains)), np.abs(energies - bond.energy(strains)))
    force, energy = (float(np.max(e[inside], initial=0.0)) for e in errors)
    edge_force, edge_energy = (float(np.max(e[~inside], initial=0.0)) for e in errors)
    return force, energy, edge_force, edge_energy
