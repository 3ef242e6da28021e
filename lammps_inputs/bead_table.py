"""Table of the force between beads for LAMMPS's `pair_style table`."""

import numpy as np

from chaincor.lammps_inputs.bonds.hertz import HERTZ, Hertz
from chaincor.lammps_inputs.bonds.table_text import section_text
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem

#: Usual number of rows, and an upper bound on the error of eta due to their interpolation.
ROWS, TABLE_ERROR = 100_000, 1e-8
# The table extends to overlaps larger by this factor than the overlap of two beads that have all
# energy of the column, up to the largest overlap.
_DEEPER, _DEEPEST = 1.02, 0.95


def bead_table_rows(problem: Problem, numerics: Numerics) -> int | None:
    """Return the number of rows of the force table; None if LAMMPS's own law of Hertz is used."""
    bond = problem.bond
    assert isinstance(bond, Hertz)
    return numerics.table_points or (None if bond.exponent == HERTZ else ROWS)


def format_bead_table(problem: Problem, rows: int) -> str:
    """
    Format the table file of the force between beads of diameter 1.

    Rows are equally spaced in the squared distance, as LAMMPS interpolates them. The last row is
    at the distance 1, where the beads touch.
    """
    bond = problem.bond
    assert isinstance(bond, Hertz)
    overlap = min(_DEEPEST, -_DEEPER * bond.compressed_strain(problem.start_energy))
    low = 1.0 - overlap
    distances = np.sqrt(np.linspace(low * low, 1.0, rows))
    distances[-1] = 1.0
    forces, energies = (f(distances - 1.0) for f in (bond.force, bond.energy))
    slope = float(bond.curvature(low - 1.0))
    header = f"N {rows} RSQ {low:.17g} 1.0 FPRIME {-slope:.17g} 0.0"
    section = section_text("BEADS", header, (distances, energies, forces))
    return f"# force of beads, {bond.title}\n\n{section}"
