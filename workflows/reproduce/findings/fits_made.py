"""Every fit of the report in one table: what, over which range, and what came out."""

from collections.abc import Iterable
from dataclasses import dataclass

from chaincor.workflows.reproduce.findings.harmonic import HarmonicLaw
from chaincor.workflows.reproduce.findings.lengths import last_exponents
from chaincor.workflows.reproduce.findings.long_limit import slope_limits
from chaincor.workflows.reproduce.findings.low_speed import (
    FIT_RANGE,
    OTHER_RANGES,
    increases,
    lj_increases,
    slope_through_origin,
)
from chaincor.workflows.reproduce.fits import PowerLaw
from chaincor.workflows.reproduce.measurements import Measurements

_SPEED = "v₀/v*"


@dataclass(frozen=True)
class Fit:
    """
    One fit y = A x^p.

    Attributes
    ----------
    what : str
        What y is.
    x : str
        The variable.
    first, last : float
        Range of x.
    points : int
        How many.
    exponent, exponent_error : float
        p and its error; the error is 0 where p is fixed, and nan for two points.
    prefactor, prefactor_error : float
        A and its error.
    judged : bool
        Whether a verdict, or a number of the text, is this one.
    """

    what: str
    x: str
    first: float
    last: float
    points: int
    exponent: float
    exponent_error: float
    prefactor: float
    prefactor_error: float
    judged: bool


def fits_made(measured: Measurements, law: HarmonicLaw) -> tuple[Fit, ...]:
    """Return all fits, those that are judged before those that tell how they depend on ranges."""
    harmonic = "1 − η, harmonic"
    found = [
        *_of(harmonic, "n", [law.both], judged=1),
        *_of(harmonic, "n", law.ranges),
        *_of(harmonic, "n", [law.mean_prefactor], judged=1),
        *_of(harmonic, "n", law.prefactors),
    ]
    for speed, (last, _) in last_exponents(measured).items():
        found += _of(f"1 − η, lj, {speed:g} v*", "n", [last], judged=1)
    for order, increase in increases(measured).items():
        found += _of(f"increase, r = {order}", _SPEED, increase.fits(), judged=1)
    for n, increase in lj_increases(measured).items():
        for ends in (FIT_RANGE, *OTHER_RANGES):
            speeds = [p.speed for p in increase.within(*ends)]
            if len(speeds) > 1:
                span, slope = (speeds[0], speeds[-1]), slope_through_origin(increase, *ends)
                what, judged = f"increase, lj, n = {n}", ends == FIT_RANGE
                found.append(Fit(what, _SPEED, *span, len(speeds), 1.0, 0.0, *slope, judged))
    found += [
        Fit(
            f"1 − η, lj, n → ∞, (v₀/v*) n^(2/3) > {limit.least_scaled_speed:g}",
            _SPEED,
            0.0,
            limit.fastest,
            limit.points,
            1.0,
            0.0,
            limit.value,
            limit.error,
            True,
        )
        for limit in slope_limits(measured)
    ]
    return tuple(found)


def _of(what: str, x: str, laws: Iterable[PowerLaw], judged: int = 0) -> list[Fit]:
    return [
        Fit(
            what,
            x,
            law.first,
            law.last,
            law.points,
            law.exponent,
            law.exponent_error,
            law.prefactor,
            law.prefactor_error,
            k < judged,
        )
        for k, law in enumerate(laws)
    ]
