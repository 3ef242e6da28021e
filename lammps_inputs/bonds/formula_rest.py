"""Find the natural length of a formula, expand the force there, and look for lost digits."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.formula_code import SERIES_TERMS, FormulaCode
from chaincor.lammps_inputs.errors import PotentialError

# Number of digits in the computation of the natural length and of the series, and in the check for
# lost digits.
_DIGITS = 40
# Relative truncation error at which the series ends, and largest strain at which the series is
# used.
_CUT, _FARTHEST = 1e-18, 0.25
# Range of strains in which the natural length must lie, and the smallest strain of the search.
_NEAREST_REST, _SHORTEST_REST, _LONGEST_REST = 1e-7, -0.5, 1.0
# Range of the stiffness at the natural length.
_SOFTEST, _STIFFEST = 1e-8, 1e8
# Largest error of the double-precision force, relative to the larger of the force and 1e-3 k |s|.
LOST = 1e-11
Refuse = Callable[[str, str], PotentialError]


def many_digits() -> Any:
    """Return a new mpmath context with 40 digits; other code uses the default context."""
    import mpmath

    context = mpmath.MPContext()
    context.dps = _DIGITS
    return context


def expand(
    code: FormulaCode, values: tuple[float, ...], refuse: Refuse
) -> tuple[Any, tuple[float, ...]]:
    """
    Find the natural length of a formula nearest to 1, and expand the force there.

    Returns the strain at the natural length, with many digits, and the series of force/strain: -k,
    -k g_1 ... If there is no stable length near 1, or the stiffness is out of bounds, raises the
    error that `refuse` makes from the problem and the remedy.
    """
    bracket, digits = _bracket(code, values, refuse), many_digits()
    force = code.function(code.force, values, digits)
    try:
        rest = digits.findroot(force, bracket, solver="anderson", tol=1e-70, maxsteps=200)
        if not bracket[0] <= rest <= bracket[1]:
            raise ValueError
        terms = digits.taylor(force, rest, SERIES_TERMS + 1)
        series = tuple(float(term) for term in terms[1:])
    except (ValueError, ZeroDivisionError, OverflowError, TypeError):
        series = (math.nan,)
    if not all(map(math.isfinite, series)) or not series[0] < 0.0:
        raise refuse(
            "has no stable natural length near 1",
            "Give an energy with a smooth minimum and positive stiffness",
        )
    if not _SOFTEST <= -series[0] <= _STIFFEST:
        raise refuse(
            f"has the stiffness {-series[0]:.3g} at rest",
            f"Scale energies so that the stiffness is near 1, or at least from {_SOFTEST:g} to "
            f"{_STIFFEST:g}",
        )
    return rest, series


def _bracket(code: FormulaCode, values: tuple[float, ...], refuse: Refuse) -> tuple[float, float]:
    """Return the two strains, closest to 0, between which the force falls through zero."""
    out = np.geomspace(_NEAREST_REST, _LONGEST_REST, 400)
    strains = np.concatenate((-out[out <= -_SHORTEST_REST][::-1], out))
    forces = np.asarray(code.function(code.force, values)(strains), dtype=float)
    forces = forces * np.ones_like(strains)
    falls = (forces[:-1] > 0.0) & (forces[1:] < 0.0)
    places = np.flatnonzero(falls)
    if not len(places):
        raise refuse(
            "has no stable natural length: its force does not change from positive to negative "
            f"between lengths {1.0 + _SHORTEST_REST:g} and {1.0 + _LONGEST_REST:g}",
            "Scale lengths so that the minimum is near length 1",
        )
    nearest = places[np.argmin(np.abs(strains[places] + strains[places + 1]))]
    return float(strains[nearest]), float(strains[nearest + 1])


def reach_of(series: tuple[float, ...]) -> float:
    """Return the strain up to which the truncation error of the series is negligible."""
    reach = _FARTHEST
    for k in range(len(series) - 6, len(series)):
        part = abs(series[k] / series[0])
        if part > 0.0:
            reach = min(reach, (_CUT / part) ** (1.0 / k))
    return reach


def lost_digits(
    code: FormulaCode,
    values: tuple[float, ...],
    rest: Any,
    force: Callable[[Array], Array],
    near: float,
    reach: tuple[float, float],
) -> tuple[float, float] | None:
    """
    Compare a force with the formula in many digits, at strains within `reach`.

    Strains are relative to `rest`. Up to `near`, the force is a series. Returns the smallest strain
    at which the relative error exceeds ``LOST``, and this error. Returns None if the error never
    exceeds ``LOST``.
    """
    digits = many_digits()
    out = np.geomspace(0.5 * near, 4.0, 16)
    strains = np.concatenate((-out[out < -0.95 * reach[0]], out[out < 0.95 * reach[1]]))
    strains = strains[np.argsort(np.abs(strains))]
    found = force(strains)
    function = code.function(code.force, values, digits)
    stiffness = float(-digits.diff(function, rest))
    for strain, one in zip(strains.tolist(), found.tolist(), strict=True):
        try:
            exact = function(rest + digits.mpf(strain))
            size = max(abs(exact), 1e-3 * stiffness * abs(strain))
            lost = float(abs(one - exact) / size)
        except (ValueError, ZeroDivisionError, OverflowError, TypeError):
            lost = math.nan
        if not lost <= LOST:
            return strain, lost
    return None
