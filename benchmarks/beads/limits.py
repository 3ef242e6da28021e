"""
Extrapolate the loss of columns of beads to infinite length.

    python -m benchmarks.beads.limits

Losses at walls of the beads' own law come from the page of C++ without its error of second order.
They approach their limit as a/n + b/n^2. The bar of the limit is the largest change of the fit when
its shortest or its longest columns are dropped. The loss at a hard wall is printed beside it.
"""

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.beads.verlet import VerletColumn

EXPONENTS = (1.5, 1.75, 2.0, 2.5, 3.0)
BEADS = (100, 200, 300, 500, 700, 1000, 1500)


def limit_of(beads: tuple[int, ...], losses: list[float]) -> float:
    """Return the limit of a fit by 1, 1/n and 1/n^2."""
    powers = np.vander(1.0 / np.array(beads), 3, increasing=True)
    return float(np.linalg.lstsq(powers, np.array(losses), rcond=None)[0][0])


def main() -> None:
    """Print losses and limits."""
    with tempfile.TemporaryDirectory() as folder:
        column = VerletColumn.compiled_in(Path(folder))
        print("exponent  limit       bar      hard wall, 300 and 1000 beads")
        for exponent in EXPONENTS:
            losses = [column.extrapolated(exponent, False, n)[0] for n in BEADS]
            limit = limit_of(BEADS, losses)
            others = [limit_of(BEADS[k:m], losses[k:m]) for k, m in ((2, None), (0, -2), (1, -1))]
            bar = max(abs(limit - other) for other in others)
            hard = [column.extrapolated(exponent, True, n)[0] for n in (300, 1000)]
            line = f"{exponent:<8g}  {limit:.6f}    {bar:.0e}    {hard[0]:.5f} {hard[1]:.5f}"
            print(line, flush=True)


if __name__ == "__main__":
    main()
