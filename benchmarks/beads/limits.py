"""
Extrapolate the loss of columns of beads to infinite length.

    python -m benchmarks.beads.limits

The walls have the same contact law as the beads. Losses come from a short C++ program and are
extrapolated to a time step of zero. With n beads, the loss differs from its limit by a/n + b/n^2.
The error bar of the limit is the largest change of the fit if the shortest or the longest columns
are omitted. The loss at a hard wall is printed, too.
"""

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.beads.verlet import VerletColumn

EXPONENTS = (1.5, 1.75, 2.0, 2.5, 3.0)
BEADS = (100, 200, 300, 500, 700, 1000, 1500)


def limit_of(beads: tuple[int, ...], losses: list[float]) -> float:
    """Return the limit from a fit of 1, 1/n and 1/n^2."""
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
