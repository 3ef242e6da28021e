"""
Test whether C'(y) = h_3(y)/y of steep fronts can be extrapolated.

    python -m benchmarks.slow_chains.limit

The fits use the minima of ``steep.csv``. The deepest minimum oscillates with y, because it changes
from wave to wave. The minimum of a polynomial through the losses of neighbouring waves does not
oscillate and is used instead. The form of the approach is not derived. Forms in y and in
t = (y/2)^(3/2)/3 are fitted. The fits that describe the points fail at y = 320;
therefore C' is not extrapolated. The modulated start of ``modulated.csv`` checks the step.
"""

from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from benchmarks.slow_chains.modulated import GRIDS
from benchmarks.slow_chains.modulated import TABLE as MODULATED
from benchmarks.slow_chains.steep import TABLE as STEEP
from chaincor.lammps_inputs.arrays import Array

# First y of the fits, and number of neighbouring waves in a polynomial.
STARTS = (60.0, 80.0, 100.0)
_WAVES = 5
# Order of the error of each table: in the spacing, and in the time step.
_STEEP_ORDER, _MODULATED_ORDER = 8, 5
# Terms of each form besides the limit. The delay of the leading soliton is of order ln t/t.
FORMS = {
    "ln t/t": (lambda y, t: np.log(t) / t,),
    "1/t": (lambda y, t: 1.0 / t,),
    "1/y": (lambda y, t: 1.0 / y,),
    "ln t/t and 1/t": (lambda y, t: np.log(t) / t, lambda y, t: 1.0 / t),
    "1/y and 1/t": (lambda y, t: 1.0 / y, lambda y, t: 1.0 / t),
}
# A form with a larger residual does not describe the points.
LARGEST_RESIDUAL = 2e-5
# y and C' of the steepest front, which is not fitted: `steep.steep_minima` with spacings 0.25 and
# 0.22, which differ by 1e-5.
STEEPEST = 320.0, 0.37503


def time_of(variable: ArrayLike) -> Array:
    """Return t, in the units of u_t + 6 u u_x + u_xxx = 0."""
    return (0.5 * np.asarray(variable)) ** 1.5 / 3.0


def points() -> tuple[Array, Array]:
    """Return y, and C'(y) of the step without the oscillation."""
    slopes = step_slopes()
    return np.array(sorted(slopes)), np.array([slopes[variable][1] for variable in sorted(slopes)])


def step_slopes() -> dict[float, Array]:
    """Return C' of the step by y: deepest and without oscillation, from two grids."""
    return _extrapolated(STEEP, lambda spacing: spacing**_STEEP_ORDER)


def modulated_slopes() -> dict[float, Array]:
    """Return C' of the modulated start, as `step_slopes` does."""
    courant = dict(GRIDS)
    return _extrapolated(
        MODULATED, lambda spacing: (spacing * courant[spacing]) ** _MODULATED_ORDER
    )


def _extrapolated(path: Path, error: Callable[[float], float]) -> dict[float, Array]:
    """Extrapolate C' of a table from its two grids, whose errors have a known ratio."""
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    slopes = {}
    for variable in np.unique(table[:, 0]):
        here = table[table[:, 0] == variable]
        fine, coarse = map(float, np.unique(here[:, 1]))
        best, rough = (
            np.array([grid[0, 3] / variable, without_swing(variable, grid[:, 2], grid[:, 3])])
            for grid in (here[here[:, 1] == spacing] for spacing in (fine, coarse))
        )
        slopes[float(variable)] = best + (best - rough) / (error(coarse) / error(fine) - 1.0)
    return slopes


def without_swing(variable: float, places: Array, losses: Array) -> float:
    """Return C' at the minimum of the polynomial through the deepest losses."""
    near, losses = places[:_WAVES] - variable, losses[:_WAVES]
    joined = np.polynomial.Polynomial.fit(near, losses, len(near) - 1)
    return float(joined(np.linspace(near.min(), near.max(), 4001)).min()) / variable


def fitted(y: Array, slope: Array, form: str) -> tuple[Array, float]:
    """Fit the limit and the factors of a form; return them and the largest residual."""
    t = time_of(y)
    design = np.column_stack([np.ones_like(t), *(-term(y, t) for term in FORMS[form])])
    best = np.linalg.lstsq(design, slope, rcond=None)[0]
    return best, float(np.abs(design @ best - slope).max())


def predicted(y: float, form: str, best: Array) -> float:
    """Return C'(y) of a fit."""
    terms = [float(term(y, time_of(y))) for term in FORMS[form]]
    return float(best[0] - np.dot(best[1:], terms))


def main() -> None:
    """Print the points, and the fits with their predictions for the steepest front."""
    for name, slopes in (("step", step_slopes()), ("modulated start", modulated_slopes())):
        for variable, (deepest, smooth) in slopes.items():
            print(f"{name}, y = {variable:g}: C' = {deepest:.6f}, without swing {smooth:.6f}")
    y, slope = points()
    steepest, computed = STEEPEST
    found = []
    for form, start in product(FORMS, STARTS):
        chosen = y >= start
        best, residual = fitted(y[chosen], slope[chosen], form)
        if residual <= LARGEST_RESIDUAL:
            found.append(predicted(steepest, form, best))
        factors = ", ".join(f"{factor:.4f}" for factor in best[1:])
        print(
            f"{form} from {start:g}: C = {best[0]:.5f}, factor {factors}, residual {residual:.1e}, "
            f"{predicted(steepest, form, best):.5f} at y = {steepest:g}"
        )
    print(
        f"y = {steepest:g}: {min(found):.5f} to {max(found):.5f} by fits that describe the points, "
        f"{computed} computed"
    )


if __name__ == "__main__":
    main()
