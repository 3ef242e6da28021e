"""
Fit the limit of C'(y) = h_3(y)/y for steep fronts, and the approach to it.

    python -m benchmarks.slow_chains.limit [--fit]

Adds the missing points of large y to ``limit.csv`` in this folder, then fits them together
with the last points of ``analysis/slow_chains/curves.csv``. The leading soliton lags behind the
edge of the modulated wave by a logarithm of t = (y/2)^(3/2)/3, so that

    C'(y) = C - (a ln t + b)/t.

The error bar of C covers the fits that begin at other y, with and without the logarithm. No random
numbers.
"""

import argparse
import csv
from itertools import product
from pathlib import Path

import numpy as np

from chaincor.analysis.slow_chains.curve import TABLE as CURVES
from chaincor.analysis.slow_chains.front import Grid

TABLE = Path(__file__).with_name("limit.csv")
HEADER = ["variable", "spacing", "loss"]
# All y on the first, then all on the second.
SPACINGS = (0.28, 0.24)
VARIABLES = [100.0, 120.0, 160.0, 200.0, 240.0, 320.0]
# Below this, kinks between waves swing C' by more than its distance to the limit changes.
STARTS = (60.0, 80.0, 100.0, 160.0)


def measure() -> None:
    """Add the points that the table lacks, as they come."""
    begun = TABLE.exists()
    with TABLE.open("a+", newline="") as file:
        file.seek(0)
        known = {(row[0], row[1]) for row in csv.reader(file)}
        writer = csv.writer(file, lineterminator="\n")
        if not begun:
            writer.writerow(HEADER)
        for spacing, variable in product(SPACINGS, VARIABLES):
            if (str(variable), str(spacing)) not in known:
                loss = min(loss for _, loss in Grid(variable, 1, spacing).minima())
                writer.writerow([variable, spacing, f"{loss:.6f}"])
                file.flush()


def points() -> tuple[np.ndarray, np.ndarray]:
    """Return y and C'(y) of all points from 40 on."""
    curves = np.loadtxt(CURVES, delimiter=",", skiprows=1)
    curves = curves[(curves[:, 0] == 3) & (curves[:, 1] >= 40.0)]
    found = {y: curves[curves[:, 1] == y, 4].min() / y for y in np.unique(curves[:, 1])}
    steep = np.loadtxt(TABLE, delimiter=",", skiprows=1)
    for variable in np.unique(steep[:, 0]):
        here = steep[steep[:, 0] == variable]
        # The finest available grid. If there are two, they show the error of the grids.
        losses = here[np.argsort(here[:, 1]), 2]
        found[float(variable)] = losses[0] / variable
        if len(losses) > 1:
            print(f"y = {variable:g}: two grids differ by {np.ptp(losses) / variable:.1e} in C'")
    return np.array(list(found)), np.array(list(found.values()))


def fitted(y: np.ndarray, slope: np.ndarray, logarithm: bool = True) -> tuple[np.ndarray, float]:
    """Fit C, a and b, and return them with the largest residual."""
    t = (0.5 * y) ** 1.5 / 3.0
    columns = [np.ones_like(t), -1.0 / t] + ([-np.log(t) / t] if logarithm else [])
    design = np.column_stack(columns)
    best = np.linalg.lstsq(design, slope, rcond=None)[0]
    return best, float(np.abs(design @ best - slope).max())


def main() -> None:
    """Measure and fit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fit", action="store_true", help="use the table that is there")
    if not parser.parse_args().fit:
        measure()
    y, slope = points()
    for variable, value in zip(y, slope, strict=True):
        print(f"y = {variable:g}: C' = {value:.5f}")
    for start in STARTS:
        chosen = y >= start
        for logarithm in (True, False):
            best, residual = fitted(y[chosen], slope[chosen], logarithm)
            terms = ", ".join(f"{value:.4f}" for value in best[1:])
            print(
                f"from {start:g}, {'with' if logarithm else 'without'} ln t: C = {best[0]:.5f}, "
                f"b and a = {terms}, residual {residual:.1e}"
            )


if __name__ == "__main__":
    main()
