"""
Fit the limit of C'(y) = h_3(y)/y for steep fronts, and the approach to it.

    python -m benchmarks.slow_chains.limit [--fit]

Adds the missing points of large y to ``limit.csv`` in this folder, by finite differences on one or
two grids. The fits use the minima of ``spectral.csv``. The deepest minimum swings as other waves of
the train take over; a polynomial through the losses of neighbouring waves has a minimum that does
not swing. The form of the approach is not derived: four forms are fitted, in y and in
t = (y/2)^(3/2)/3. The bar of the limit covers all of these fits. No random numbers.
"""

import argparse
import csv
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.slow_chains.spectral import TABLE as SPECTRAL
from chaincor.analysis.slow_chains.front import Grid

TABLE = Path(__file__).with_name("limit.csv")
HEADER = ["variable", "spacing", "loss"]
# All y on the first, then all on the second.
SPACINGS = (0.28, 0.24)
VARIABLES = [100.0, 120.0, 160.0, 200.0, 240.0, 320.0]
# First y of the fits, and number of neighbouring waves that a polynomial joins.
STARTS = (36.0, 45.0, 50.0, 60.0)
_WAVES = 5
# Terms of each form, besides the limit. The lag of the leading soliton is of order ln t/t.
FORMS = {
    "ln t/t": (lambda y, t: np.log(t) / t,),
    "1/t": (lambda y, t: 1.0 / t,),
    "1/y": (lambda y, t: 1.0 / y,),
    "ln t/t and 1/t": (lambda y, t: np.log(t) / t, lambda y, t: 1.0 / t),
}


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
    """Return y and C'(y) without the swing."""
    table = np.loadtxt(SPECTRAL, delimiter=",", skiprows=1)
    table = table[(table[:, 0] == 3) & (table[:, 1] >= STARTS[0])]
    variables = np.unique(table[:, 1])
    smooth = []
    for variable in variables:
        here = table[table[:, 1] == variable][:_WAVES]
        places = here[:, 2] - variable
        joined = np.polynomial.Polynomial.fit(places, here[:, 3], len(places) - 1)
        losses = joined(np.linspace(places.min(), places.max(), 4001))
        smooth.append(losses.min() / variable)
        print(f"y = {variable:g}: C' = {here[:, 3].min() / variable:.6f}, smooth {smooth[-1]:.6f}")
    return variables, np.array(smooth)


def fitted(y: np.ndarray, slope: np.ndarray, form: str) -> tuple[np.ndarray, float]:
    """Fit the limit and the factors of a form, and return them with the largest residual."""
    t = (0.5 * y) ** 1.5 / 3.0
    design = np.column_stack([np.ones_like(t), *(-term(y, t) for term in FORMS[form])])
    best = np.linalg.lstsq(design, slope, rcond=None)[0]
    return best, float(np.abs(design @ best - slope).max())


def main() -> None:
    """Measure and fit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fit", action="store_true", help="use the table that is there")
    if not parser.parse_args().fit:
        measure()
    for variable, spacing, loss in np.loadtxt(TABLE, delimiter=",", skiprows=1):
        print(f"y = {variable:g}, grid {spacing:g}: C' = {loss / variable:.5f}")
    y, slope = points()
    limits = []
    for form, start in product(FORMS, STARTS):
        chosen = y >= start
        best, residual = fitted(y[chosen], slope[chosen], form)
        limits.append(best[0])
        factors = ", ".join(f"{factor:.4f}" for factor in best[1:])
        print(
            f"{form} from {start:g}: C = {best[0]:.5f}, factor {factors}, residual {residual:.1e}"
        )
    print(f"all fits: {min(limits):.5f} to {max(limits):.5f}")


if __name__ == "__main__":
    main()
