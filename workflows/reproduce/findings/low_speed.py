"""Low speed: alpha of the pair, the slope C, and the increase of dissipation (NH section III)."""

from dataclasses import dataclass

import numpy as np

from chaincor.analysis.pair_theory import pair_interval, pair_interval_slope
from chaincor.analysis.theory import PAIR_INTERVAL, low_speed_dissipation_slope
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.fits import PowerLaw, fit_power_law, parameter_errors
from chaincor.workflows.reproduce.measurements import Measurements, Point
from chaincor.workflows.reproduce.plan import PAPER_ALPHA

# One range for all that the paper fits at low speed, C and the slopes of figure 6, whose range it
# does not say: the decade from the slowest speed of its figures on, 0.008 v*.
FIT_RANGE = (0.01, 0.1)
# How far a number depends on it is told by its halves, and by going on to the fastest speed.
OTHER_RANGES = ((0.01, 0.0317), (0.0317, 0.1), (0.01, np.inf))
# C of eq. (18), as printed.
PAPER_SLOPE = 2.61
PAPER_SLOPES = {3: 1.34, 4: 2.09, 5: 3.14}


@dataclass(frozen=True)
class Increase:
    """
    1 - eta of an anharmonic chain less that of the harmonic one of the same length.

    Attributes
    ----------
    points : list of Point
        Anharmonic, in the order of speed.
    baseline : Point
        The harmonic chain.
    speeds, values, errors : ndarray
        v0/v*, the increase and its error bar.
    """

    points: list[Point]
    baseline: Point
    speeds: np.ndarray
    values: np.ndarray
    errors: np.ndarray

    def fits(self) -> list[PowerLaw]:
        """Fit a power law over the range that is judged and over the others, where points do."""
        fits = (self.fit(*ends) for ends in (FIT_RANGE, *OTHER_RANGES))
        return [fit for fit in fits if np.isfinite(fit.exponent_error)]

    def local_powers(self) -> tuple[np.ndarray, np.ndarray]:
        """
        Return speeds half-way between neighbours, and the power between these.

        It is nan where dissipation does not increase.
        """
        with np.errstate(invalid="ignore", divide="ignore"):
            powers = np.diff(np.log(self.values)) / np.diff(np.log(self.speeds))
        return np.sqrt(self.speeds[1:] * self.speeds[:-1]), powers

    def within(self, first: float, last: float) -> list[Point]:
        """Return the points of a range of speeds."""
        return [p for p in self.points if first <= p.speed <= last]

    def fit(self, first: float, last: float) -> PowerLaw:
        """Fit a power law over a range of speeds."""
        within = (self.speeds >= 0.999 * first) & (self.speeds <= 1.001 * last)
        return fit_power_law(self.speeds[within], self.values[within], errors=self.errors[within])


def increase_of(points: list[Point], baseline: list[Point]) -> Increase | None:
    """
    Subtract the harmonic baseline; None where there is nothing to subtract.

    Of the baseline's points the in-house propagator's, which are exact, are preferred.
    """
    if not points or not baseline:
        return None
    zero = baseline[0]
    exact = zero.restitution, zero.error
    if zero.in_house is not None and zero.in_house.result is not None:
        exact = zero.in_house.result["restitution"], zero.bar_of(zero.in_house)
    return Increase(
        points=points,
        baseline=zero,
        speeds=np.array([p.speed for p in points]),
        values=exact[0] - np.array([p.restitution for p in points]),
        errors=exact[1] + np.array([p.error for p in points]),
    )


def increases(measured: Measurements) -> dict[int, Increase]:
    """Return the increase for each order r that has points."""
    baseline = measured.select("increase", "harmonic")
    found = {}
    for order in PAPER_SLOPES:
        increase = increase_of(measured.select("increase", "power", power_order=order), baseline)
        if increase is not None:
            found[order] = increase
    return found


def lj_increases(measured: Measurements) -> dict[int, Increase]:
    """Return the increase of lj chains for each length."""
    lengths = sorted({p.particles for p in measured.points["slopes"]})
    found = {}
    for n in lengths:
        chains = measured.select("slopes", "lj", particles=n)
        increase = increase_of(chains, measured.select("slopes", "harmonic", particles=n))
        if increase is not None:
            found[n] = increase
    return found


def low_speed_findings(measured: Measurements) -> dict[str, Finding]:
    """Return what is found at low speed, by the key of the rule that judges it."""
    return {
        "alpha": _alpha(measured),
        **_constants(),
        **_simulated_slopes(measured),
    }


def _accord(slopes: list[float]) -> Finding:
    """Say whether theory's C, as printed and as it follows, is outside all simulated values."""
    theory = (PAPER_SLOPE, low_speed_dissipation_slope(pair_interval_slope(LennardJones())))
    apart = min(theory) > max(slopes)
    return Finding(
        float(apart),
        0.0,
        f"theory: {theory[0]} as printed, {theory[1]:.2f} with the dropped factor put back, which "
        f"is further still from every simulated value, {min(slopes):.2f} to {max(slopes):.2f} "
        "here; the authors say so themselves",
    )


def pair_alphas(points: list[Point]) -> np.ndarray:
    """
    Return (1 - sqrt(2) dt/pi)/(v0/v*) of chains of two: it tends to alpha at low speed.

    It is nan where there are not two contacts.
    """
    values = []
    for point in points:
        arrays = {} if point.answer is None else point.answer.arrays
        times = arrays.get("contact_times", np.empty(0))
        interval = times[1] - times[0] if len(times) == 2 else np.nan
        values.append((1.0 - interval / PAIR_INTERVAL) / point.speed)
    return np.array(values)


def _alpha(measured: Measurements) -> Finding:
    points = measured.select("pair", "lj")
    slow = [p for p in points if p.speed <= 0.1]
    if len(slow) < 4:
        return Finding(np.nan, np.nan, "fewer than four speeds")
    speeds, values = np.array([p.speed for p in slow]), pair_alphas(slow)
    ours = sum(p.source == "lammps" for p in slow)
    (_, _, limit), (_, _, shorter) = (
        np.polyfit(speeds[:count], values[:count], 2) for count in (len(slow), len(slow) - 1)
    )
    bond = LennardJones()
    deviation = max(
        abs(pair_interval(bond, p.scene.impact_velocity) / PAIR_INTERVAL - 1.0 + a * p.speed)
        for p, a in zip(slow, values, strict=True)
    )
    return Finding(
        float(limit),
        float(abs(limit - shorter)) + 1e-5,
        f"limit v₀ → 0 of a parabola through {len(slow)} speeds up to 0.1 v*, {ours} by LAMMPS and "
        f"{len(slow) - ours} in-house; ± what one speed less changes; first-order theory gives "
        f"{pair_interval_slope(bond):.5f}; intervals agree with the exact quadrature to "
        f"{deviation:.0e}",
        slow,
    )


def _constants() -> dict[str, Finding]:
    """Work out the C that is printed, and the C that follows."""
    return {
        "printed constant": Finding(
            32.0 * PAPER_ALPHA / np.pi**2, 0.0, f"32α/π² with α = {PAPER_ALPHA}"
        ),
        "theoretical slope": Finding(
            low_speed_dissipation_slope(pair_interval_slope(LennardJones())),
            0.0,
            "4α: eq. (7) with v² = (π²/8) v₀² kept, as the 0.652 of the harmonic law has it; see "
            "eqs. (16), (18) among the [slips](#slips)",
        ),
    }


def slope_through_origin(
    increase: Increase, first: float = FIT_RANGE[0], last: float = FIT_RANGE[1]
) -> tuple[float, float]:
    """Return C of a least-squares line through the origin over a range, and its error."""
    within = (increase.speeds >= first) & (increase.speeds <= last)
    u, y = increase.speeds[within], increase.values[within]
    if u.size < 2:
        return np.nan, np.nan
    slope = float(u @ y / (u @ u))
    error = parameter_errors(u[:, None], y - slope * u, increase.errors[within])[0]
    return slope, float(error)


def _simulated_slopes(measured: Measurements) -> dict[str, Finding]:
    found = lj_increases(measured)
    if not found:
        missing = Finding(np.nan, np.nan, "no points")
        return dict.fromkeys(("simulated slope", "not in accord"), missing)
    shortest = found[min(found)]
    slope, error = slope_through_origin(shortest)
    ranges = (FIT_RANGE, *OTHER_RANGES)
    others = [slope_through_origin(i, *ends)[0] for i in found.values() for ends in ranges]
    known = [value for value in others if np.isfinite(value)]
    lengths = ", ".join(f"{slope_through_origin(i)[0]:.2f} (n = {n})" for n, i in found.items())
    used = shortest.within(*FIT_RANGE)
    ends = f"{used[0].speed:.3g} to {used[-1].speed:.3g} v*" if used else "no points"
    return {
        "not in accord": _accord(known) if known else Finding(np.nan, np.nan, "no points"),
        "simulated slope": Finding(
            slope,
            error,
            f"line through the origin, {len(used)} points, {ends}; by length: {lengths}; over "
            "other ranges see [the fits](#fits); for n → ∞ see [beyond the paper](#beyond)",
            used,
            (min(known), max(known)) if known else None,
        ),
    }
