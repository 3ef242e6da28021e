"""
Fit the limit of C'(y) = h_3(y)/y for steep fronts, and the approach to the limit.

    python -m benchmarks.slow_chains.limit

The fits use the minima of ``spectral.csv``, whose fronts start from a step, and from y = 160 on
those of ``modulated.csv``. The deepest minimum oscillates with y, because it changes from wave to
wave. The minimum of a polynomial through the losses of neighbouring waves does not oscillate and is
used instead. The form of the approach is not derived. Forms in y and in t = (y/2)^(3/2)/3 are
fitted.
"""

from itertools import product

import numpy as np

from benchmarks.slow_chains.modulated import TABLE as MODULATED
from benchmarks.slow_chains.spectral import TABLE as SPECTRAL
from chaincor.lammps_inputs.arrays import Array

# First y of the fits, and number of neighbouring waves in a polynomial.
STARTS = (50.0, 60.0, 80.0)
_WAVES = 5
# The modulated start replaces the step from this y on.
_MODULATED_FROM = 160.0
# Time steps on the two grids of `modulated`, and the order measured at y = 60 and 100.
_COARSE, _FINE, _ORDER = 0.45, 0.3, 5
# The modulated start makes C' too large by this number divided by t, as measured at y = 60 and 100.
_START_EXCESS = 0.004
# Terms of each form besides the limit. The delay of the leading soliton is of order ln t/t.
FORMS = {
    "ln t/t": (lambda y, t: np.log(t) / t,),
    "1/t": (lambda y, t: 1.0 / t,),
    "1/y": (lambda y, t: 1.0 / y,),
    "ln t/t and 1/t": (lambda y, t: np.log(t) / t, lambda y, t: 1.0 / t),
    "1/y and 1/t": (lambda y, t: 1.0 / y, lambda y, t: 1.0 / t),
}
# A form with a larger residual does not describe the approach.
LARGEST_RESIDUAL = 5e-5


def time_of(variable: Array) -> Array:
    """Return t, in the units of u_t + 6 u u_x + u_xxx = 0."""
    return (0.5 * variable) ** 1.5 / 3.0


def points() -> tuple[Array, Array]:
    """Return y, and C'(y) without the oscillation."""
    steps = np.loadtxt(SPECTRAL, delimiter=",", skiprows=1)
    steps = steps[(steps[:, 0] == 3) & (steps[:, 1] >= STARTS[0])]
    found = {}
    for variable in np.unique(steps[:, 1]):
        here = steps[steps[:, 1] == variable]
        found[variable] = _without_swing(variable, here[:, 2], here[:, 3])
    for variable, slopes in modulated_slopes().items():
        if variable >= _MODULATED_FROM:
            found[variable] = slopes[1] - _START_EXCESS / time_of(variable)
    variables = np.array(sorted(found))
    return variables, np.array([found[variable] for variable in variables])


def modulated_slopes() -> dict[float, tuple[float, float]]:
    """Return C' of the modulated start by y: deepest and without oscillation, from two grids."""
    table = np.loadtxt(MODULATED, delimiter=",", skiprows=1)
    slopes = {}
    for variable in np.unique(table[:, 0]):
        grids = [table[(table[:, 0] == variable) & (table[:, 1] == grid)] for grid in (0.36, 0.3)]
        coarse, fine = (
            np.array([here[0, 3] / variable, _without_swing(variable, here[:, 2], here[:, 3])])
            for here in grids
        )
        best = fine + (fine - coarse) / ((_COARSE / _FINE) ** _ORDER - 1.0)
        slopes[float(variable)] = (float(best[0]), float(best[1]))
    return slopes


def _without_swing(variable: float, places: Array, losses: Array) -> float:
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


def main() -> None:
    """Print the points and the fits."""
    for variable, (deepest, _) in modulated_slopes().items():
        print(f"y = {variable:g}, modulated start: C' = {deepest:.6f}")
    y, slope = points()
    for variable, smooth in zip(y, slope, strict=True):
        print(f"y = {variable:g}: without swing {smooth:.6f}")
    limits = []
    for form, start in product(FORMS, STARTS):
        chosen = y >= start
        best, residual = fitted(y[chosen], slope[chosen], form)
        if residual <= LARGEST_RESIDUAL:
            limits.append(best[0])
        factors = ", ".join(f"{factor:.4f}" for factor in best[1:])
        print(
            f"{form} from {start:g}: C = {best[0]:.5f}, factor {factors}, residual {residual:.1e}"
        )
    print(f"fits that describe the points: {min(limits):.5f} to {max(limits):.5f}")


if __name__ == "__main__":
    main()
