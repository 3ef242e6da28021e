"""
Compute the loss of steep fronts from a step, by finite differences on two grids for each y.

    python -m benchmarks.slow_chains.steep

Adds the missing fronts to ``steep.csv`` in this folder: the deepest minima of the loss of cubic
bonds. The grids are coarser than those of ``analysis/slow_chains/curves.csv``, because the cost of
a front grows as y^3. Neighbouring grids show an error of order 8: ``limit`` extrapolates with it.
"""

from pathlib import Path

from benchmarks.slow_chains.growing_table import growing_table
from chaincor.analysis.slow_chains.front import Grid

TABLE = Path(__file__).with_name("steep.csv")
HEADER = ["variable", "spacing", "place", "loss"]
VARIABLES = (60.0, 80.0, 100.0, 120.0, 160.0, 240.0)
# Spacings in widths of the leading soliton.
SPACINGS = (0.25, 0.2)
# Number of minima of the table for each front.
_MINIMA = 5


def steep_minima(variable: float, spacing: float) -> list[tuple[float, float]]:
    """
    Return place and loss of the deepest minima of the loss, the deepest first.

    Parameters
    ----------
    variable : float
        y of cubic bonds, positive.
    spacing : float
        Spacing in widths of the leading soliton.
    """
    found = Grid(variable, 1, spacing).minima()
    return sorted(found, key=lambda minimum: minimum[1])[:_MINIMA]


def main() -> None:
    """Add the fronts that the table lacks, as they come."""
    with growing_table(TABLE, HEADER) as (rows, add):
        known = {(row[0], row[1]) for row in rows}
        for variable in VARIABLES:
            for spacing in SPACINGS:
                if (str(variable), str(spacing)) not in known:
                    found = steep_minima(variable, spacing)
                    add([variable, spacing, f"{x:.5f}", f"{loss:.6f}"] for x, loss in found)


if __name__ == "__main__":
    main()
