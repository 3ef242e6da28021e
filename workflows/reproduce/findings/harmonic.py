"""Harmonic chains (NH section II): contacts at n = 500, the law in n, independence of v0."""

from dataclasses import dataclass

import numpy as np

from chaincor.analysis.contacts import contact_statistics
from chaincor.analysis.theory import (
    HARMONIC_DISSIPATION_COEFFICIENT,
    basile_dumont_energies,
    harmonic_dissipation_limit,
)
from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.findings.independence import independence_findings
from chaincor.workflows.reproduce.fits import PowerLaw, fit_over_ranges, fit_power_law
from chaincor.workflows.reproduce.measurements import Answer, Measurements, Point

# The paper's numbers in brackets are from a chain of this length.
PAPER_CHAIN = 500
# The factor that it prints in eq. (12).
PAPER_FACTOR = 0.652
# The fits that are judged begin here: shorter chains are not on the law, as figure 3 shows.
_LAW_FROM = 100
# How far they depend on the range is told by these.
_RANGES = ((30, 300), (100, 1000), (200, 2000), (500, 20000), (1000, 20000))
_PREFACTOR_RANGES = ((100, 1000), (1000.5, 3000), (3000.5, 20000))


@dataclass(frozen=True)
class HarmonicLaw:
    """
    The law 1 - eta = A n^p for harmonic chains.

    Attributes
    ----------
    both : PowerLaw
        Both fitted, all points from n = 100 on (all there are if none is so long).
    mean_prefactor : PowerLaw
        A alone, p = -2/3, the same points.
    ranges, prefactors : list of PowerLaw
        Both, and A alone, fitted over other ranges.
    """

    both: PowerLaw
    mean_prefactor: PowerLaw
    ranges: list[PowerLaw]
    prefactors: list[PowerLaw]


def harmonic_law(measured: Measurements) -> HarmonicLaw:
    """Fit the law."""
    points = measured.select("harmonic_sizes", "harmonic")
    long = [p for p in points if p.particles >= _LAW_FROM] or points
    n, lost, bars = _coordinates(points)
    n_long, lost_long, bars_long = _coordinates(long)
    power = -2.0 / 3.0
    return HarmonicLaw(
        both=fit_power_law(n_long, lost_long, errors=bars_long),
        mean_prefactor=fit_power_law(n_long, lost_long, power, bars_long),
        ranges=fit_over_ranges(n, lost, _RANGES, errors=bars),
        prefactors=fit_over_ranges(n, lost, _PREFACTOR_RANGES, power, bars),
    )


def _coordinates(points: list[Point]) -> tuple[list[int], list[float], list[float]]:
    return (
        [p.particles for p in points],
        [1.0 - p.restitution for p in points],
        [p.error for p in points],
    )


def describe_prefactors(law: HarmonicLaw) -> str:
    """Write how the prefactor depends on the range."""
    return ", ".join(
        f"{fit.prefactor:.3f} ± {fit.prefactor_error:.3f} (n = {fit.first:.0f} to {fit.last:.0f})"
        for fit in law.prefactors
    )


def _span(values: list[float]) -> tuple[float, float] | None:
    return (min(values), max(values)) if values else None


def harmonic_findings(measured: Measurements, law: HarmonicLaw) -> dict[str, Finding]:
    """Return what is found on harmonic chains, by the key of the rule that judges it."""
    points = measured.select("harmonic_sizes", "harmonic")
    fitted = [p for p in points if p.particles >= _LAW_FROM]
    fit, mean = law.both, law.mean_prefactor
    scatter = [(1.0 - p.restitution) * p.particles ** (2.0 / 3.0) for p in fitted] or [np.nan]
    excess = mean.prefactor / PAPER_FACTOR - 1.0
    return {
        **_paper_chain(points),
        "contact time": _contact_time(points),
        **_of_two(points),
        "leading order": _leading_order(),
        "harmonic exponent": Finding(
            fit.exponent,
            fit.exponent_error,
            f"fit to {fit.points} points, n = {fit.first:.0f} to {fit.last:.0f}; over other ranges "
            "see [the fits](#fits)",
            fitted,
            _span([f.exponent for f in law.ranges]),
        ),
        "harmonic prefactor": Finding(
            mean.prefactor,
            mean.prefactor_error,
            f"exponent fixed at −2/3, {mean.points} points, n = {mean.first:.0f} to "
            f"{mean.last:.0f}; it falls with the length, towards "
            f"{harmonic_dissipation_limit():.4f}, which a front that disperses as Airy's function "
            "leaves in an infinite chain: "
            f"{describe_prefactors(law)}; single lengths from {min(scatter):.2f} to "
            f'{max(scatter):.2f}. Judged as words, because the paper says that the law "agrees '
            f'very well"; as digits it would be a correction of {100.0 * excess:+.1f} %, shrinking '
            "with n",
            fitted,
            _span([f.prefactor for f in law.prefactors]),
        ),
        "formula prefactor": Finding(
            HARMONIC_DISSIPATION_COEFFICIENT,
            0.0,
            "the closed form of the integral that the printed approximation leads to, with "
            "v² = (π²/8) v₀²",
        ),
        **independence_findings(measured),
    }


_OF_PAPER_CHAIN = (
    "constant intervals",
    "constant speeds",
    "external frequency",
    "interval",
    "contacts per particle",
    "incoming speed",
)


def _leading_order() -> Finding:
    """Put omega_j = pi j/n into eq. (7): f dt = 2n turns each mode by whole periods."""
    linear = np.pi * np.arange(PAPER_CHAIN) / PAPER_CHAIN
    left = 2.0 / PAPER_CHAIN * np.sum(basile_dumont_energies(PAPER_CHAIN, frequencies=linear))
    exact = 2.0 / PAPER_CHAIN * np.sum(basile_dumont_energies(PAPER_CHAIN))
    return Finding(
        float(1.0 - left),
        1e-12,
        f"eq. (7) summed over j with ω_j = πj/n, n = {PAPER_CHAIN}, and eqs. (8)–(10), ± rounding; "
        f"with the chain's own ω_j it is {1.0 - exact:.5f}",
    )


def _paper_chain(points: list[Point]) -> dict[str, Finding]:
    chain = [p for p in points if p.particles == PAPER_CHAIN]
    if not chain or chain[0].answer is None:
        nan = Finding(float("nan"), float("nan"), f"no result at n = {PAPER_CHAIN}")
        return dict.fromkeys(_OF_PAPER_CHAIN, nan)
    point = chain[0]
    assert point.answer is not None
    ours = _contacts(point, point.answer)
    # Contacts have no bar of their own: what the two engines differ by stands for it.
    both = [_contacts(point, a) for a in (point.lammps, point.in_house) if a and a.result]
    error = dict.fromkeys(ours, float("nan"))
    if len(both) == 2:
        error = {name: abs(both[0][name] - both[1][name]) for name in ours}
    where = f"n = {PAPER_CHAIN}, {point.engine_name}; ± what the engines differ by"
    highest = 2.0 * np.sin(0.5 * np.pi * (PAPER_CHAIN - 1) / PAPER_CHAIN)
    of_momentum = (1.0 + point.restitution**0.5) / (2.0 * ours["share"])
    texts = {
        "constant intervals": (
            "spread of intervals",
            f"standard deviation over mean of {ours['count'] - 1:g} intervals, {where}; the last "
            f"is {ours['last interval']:.2f}",
        ),
        "constant speeds": (
            "spread of speeds",
            f"standard deviation over mean of {ours['count']:g} incoming speeds, {where}; the last "
            f"is {ours['last speed']:.2f} v₀",
        ),
        "external frequency": (
            "frequency",
            f"2π over the mean interval, {where}; the highest mode has {highest:.3f}, so that it "
            f"is above all modes on average, and for all intervals but {ours['long']:g}. What the "
            "paper concludes from it is among the [slips](#slips)",
        ),
        "interval": (
            "interval",
            f"mean over {ours['count'] - 1:g} intervals, {where}; median {ours['median']:.4f}",
        ),
        "contacts per particle": (
            "share",
            f"{ours['count']:g} contacts, n = {PAPER_CHAIN}, {point.engine_name}; the paper's "
            f"0.867 would be {0.867 * PAPER_CHAIN:.1f} contacts, which is no whole number",
        ),
        "incoming speed": (
            "speed",
            f"mean over {ours['count']:g} contacts, {where}; momentum alone asks for "
            f"n(1 + √η)/(2f) = {of_momentum:.4f}",
        ),
    }
    return {
        key: Finding(ours[name], error[name], text, chain) for key, (name, text) in texts.items()
    }


def _contacts(point: Point, answer: Answer) -> dict[str, float]:
    """Return what is asked of the contacts of a chain, in units of 1/omega and v0."""
    arrays, velocity = answer.arrays, point.scene.impact_velocity
    numbers = contact_statistics(
        arrays["contact_times"], arrays["contact_speeds"], point.particles, velocity
    )
    assert numbers.mean_interval is not None
    assert numbers.median_interval is not None
    assert numbers.mean_speed is not None
    intervals = np.diff(arrays["contact_times"])
    speeds = np.asarray(arrays["contact_speeds"]) / velocity
    return {
        "count": float(numbers.count),
        "share": numbers.per_particle,
        "interval": numbers.mean_interval,
        "median": numbers.median_interval,
        "speed": numbers.mean_speed,
        "spread of intervals": float(np.std(intervals) / np.mean(intervals)),
        "spread of speeds": float(np.std(speeds) / np.mean(speeds)),
        "last interval": float(intervals[-1]),
        "last speed": float(speeds[-1]),
        "long": float(np.sum(intervals > np.pi)),
        "frequency": float(2.0 * np.pi / np.mean(intervals)),
    }


def _of_two(points: list[Point]) -> dict[str, Finding]:
    """Solve n = 2: the interval is that of the chain of two, the other estimates follow from it."""
    chain = [p for p in points if p.particles == 2 and p.answer is not None]
    missing = Finding(float("nan"), float("nan"), "no result at n = 2")
    keys = ("interval of two", "contacts of two", "speed of two")
    if not chain or len(times := chain[0].answer.arrays["contact_times"]) != 2:  # type: ignore[union-attr]
        return dict.fromkeys(keys, missing)
    interval = float(times[1] - times[0])
    both = [
        a.arrays["contact_times"] for a in (chain[0].lammps, chain[0].in_house) if a and a.result
    ]
    error = 1e-9 + max(abs(float(np.ptp(t)) - interval) for t in both)
    share = 2.0 / interval
    where = f"n = 2, {chain[0].engine_name}"
    return {
        keys[0]: Finding(
            interval,
            error,
            f"interval between the two contacts, {where}; ± what the engines differ by",
            chain,
        ),
        keys[1]: Finding(
            share,
            share * error / interval,
            f"f Δt = 2n, contacts for as long as sound goes there and back, with Δt of {where}. "
            "That it follows from n = 2 alone does not hold, see the [slips](#slips)",
            chain,
        ),
        keys[2]: Finding(
            1.0 / share,
            error / 2.0,
            f"2 f v = 2 n v₀, the momentum of a collision without loss, with that f; {where}, has "
            "v = v₀ itself. That it follows from n = 2 alone does not hold, see the "
            "[slips](#slips)",
            chain,
        ),
    }


def _contact_time(points: list[Point]) -> Finding:
    long = [p for p in points if p.particles >= 100]
    if not long:
        return Finding(float("nan"), float("nan"), "no chain of 100 or more")
    ratios = [p.answer.result["last_contact_time"] / (p.particles - 1.0) for p in long]  # type: ignore[union-attr,index]
    last = max(long, key=lambda p: p.particles)
    return Finding(
        float(np.mean(ratios)),
        float(np.ptp(ratios)) / 2.0,
        f"mean of t_c/τ over {len(long)} chains, n = {min(p.particles for p in long)} to "
        f"{last.particles}, ± half of their span; {ratios[long.index(last)]:.4f} for the longest",
        long,
    )
