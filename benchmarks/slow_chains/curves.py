"""
The curves of loss that ``analysis.slow_chains.curve`` interpolates.

    python -m benchmarks.slow_chains.curves

Writes ``analysis/slow_chains/curves.csv``: for bonds of lowest anharmonic order 3 and 4 the loss at
each y, and what the extrapolation from two grids changed. No random numbers; ten minutes.
"""

import csv
from pathlib import Path

from chaincor.analysis.slow_chains.curve import TABLE
from chaincor.analysis.slow_chains.front import front_loss

VARIABLES = [0.0, 0.1, 0.3, 0.6, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.5, 8.0, 10.0, 12.0]
LARGE = [16.0, 20.0, 30.0]


def main() -> None:
    """Compute the curves and write them."""
    rows = []
    for order, variables in ((3, VARIABLES + LARGE), (4, VARIABLES)):
        for variable in variables:
            front = front_loss(variable, order)
            rows.append([order, variable, f"{front.loss:.6f}", f"{front.error:.6f}"])
            print(*rows[-1], flush=True)
    with Path(TABLE).open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["order", "variable", "loss", "error"])
        writer.writerows(rows)


if __name__ == "__main__":
    main()
