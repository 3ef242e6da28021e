"""
Compute the curves of loss that ``analysis.slow_chains.curve`` interpolates.

    python -m benchmarks.slow_chains.curves [--check]

Adds the missing values of y to ``analysis/slow_chains/curves.csv``. For bonds of lowest anharmonic
order 3 and 4, the table has the two deepest minima at each y, the wave of each minimum, and the
error of each minimum due to the grids. An interrupted run can be repeated and keeps the finished
points. ``--check`` computes points between the points of the table, and prints the interpolation
error.
"""

import argparse
import csv
from collections.abc import Iterator
from itertools import chain, product
from pathlib import Path

import numpy as np

from benchmarks.slow_chains.growing_table import growing_table
from chaincor.analysis.slow_chains.curve import TABLE, limiting_loss, limiting_loss_error
from chaincor.analysis.slow_chains.front import front_loss

HEADER = ["order", "variable", "wave", "place", "loss", "error"]
# Values of y between points of the table, and near those at which the deepest minimum changes to
# another wave.
CHECKS = {
    3: [
        *(-9.0, -0.7, 0.2, 1.3, 2.7, 5.2, 8.3, 11.2, 15.5, 17.7, 18.2, 18.6, 24.5, 30.5, 30.8),
        *(31.3, 36.5, 41.0, 43.0, 51.0, 59.0, 67.0, 75.0),
    ],
    4: [-9.0, -0.7, 0.2, 1.3, 2.7, 5.2, 8.3, 11.2, 13.4, 13.5, 17.5, 22.5, 29.0],
}
# Change of a minimum's position with y, as long as it is at the same wave.
_DRIFT = 1.25
# Minima that are higher than the deepest by this fraction of y are not used.
_NEAR = 0.04


def wanted() -> Iterator[tuple[int, float, float]]:
    """Yield order, y and refinement of the grids for each point."""
    for variable in np.arange(13.0, 41.0):
        yield 3, float(variable), 0.7
    slow = chain(np.arange(-6.0, 12.1, 0.5), np.arange(-20.0, -6.0, 2.0))
    for variable, order in product(slow, (3, 4)):
        yield order, float(variable), 1.0
    for variable in np.arange(42.0, 81.0, 2.0):
        yield 3, float(variable), 0.5
    for variable in chain(np.arange(13.0, 20.1), np.arange(22.0, 30.1, 2.0), np.arange(33, 46, 3)):
        yield 4, float(variable), 0.85


def measure() -> None:
    """Add the points that the table lacks, as soon as they are computed."""
    with growing_table(TABLE, HEADER) as (rows, add):
        known = {(row[0], row[1]) for row in rows}
        for order, variable, refinement in wanted():
            if (str(order), str(variable)) in known:
                continue
            deepest = front_loss(variable, order, refinement).minima[:2]
            numbers = ((found.place, found.loss, found.error) for found in deepest)
            add([order, variable, 0, *(f"{x:.6f}" for x in each)] for each in numbers)


def name_waves() -> None:
    """Number the waves of the minima, in the order in which they become deepest; sort rows."""
    table = np.loadtxt(TABLE, delimiter=",", skiprows=1)
    rows = []
    for order in (3, 4):
        last: dict[int, tuple[float, float]] = {}
        for variable in np.unique(table[table[:, 0] == order, 1]):
            here = table[(table[:, 0] == order) & (table[:, 1] == variable)]
            here = here[here[:, 4] <= here[:, 4].min() + _NEAR * max(variable, 0.0)]
            # A minimum belongs to the wave whose expected position is nearest.
            for place, loss, error in here[np.argsort(-here[:, 3]), 3:]:
                wave = _wave_at(place, variable, last)
                last[wave] = (variable, place)
                numbers = [f"{x:.6f}" for x in (place, loss, error)]
                rows.append([order, variable, wave, *numbers])
    with Path(TABLE).open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEADER)
        writer.writerows(rows)


def _wave_at(place: float, variable: float, last: dict[int, tuple[float, float]]) -> int:
    """Return the wave whose minimum is expected nearest; a new wave is behind all others."""
    if not last:
        return 1
    expected = {wave: x + _DRIFT * (variable - y) for wave, (y, x) in last.items()}
    nearest = min(expected, key=lambda wave: abs(expected[wave] - place))
    new = place < min(expected.values()) and abs(expected[nearest] - place) > 2.0
    return max(last) + 1 if new and variable > 0.0 else nearest


def check() -> None:
    """Print the interpolation error between the points of the table, and its error bar."""
    for order, variables in CHECKS.items():
        for variable in variables:
            front = front_loss(variable, order, 1.0 if variable <= 12.0 else 0.6)
            missed = float(limiting_loss(variable, order)) - front.loss
            bar = float(limiting_loss_error(variable, order))
            print(f"{order} {variable:g} {front.loss:.6f} {missed:+.6f} {bar:.6f}", flush=True)


def main() -> None:
    """Compute the curves and write them, or check them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="compute points between the table's")
    if parser.parse_args().check:
        check()
        return
    measure()
    name_waves()


if __name__ == "__main__":
    main()
