"""Beyond the paper: what the measurements say on questions it does not ask."""

from dataclasses import dataclass

import numpy as np

from chaincor.analysis.pair_theory import pair_interval_slope
from chaincor.analysis.theory import low_speed_dissipation_slope
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.workflows.pages.typesetting import format_value
from chaincor.workflows.reproduce.figures.breaking import describe_breaking
from chaincor.workflows.reproduce.figures.spectra import half_of_kinetic
from chaincor.workflows.reproduce.findings.free_flight import AVERAGED_OVER, LAST, FreeFlight
from chaincor.workflows.reproduce.findings.lengths import falls, last_exponents
from chaincor.workflows.reproduce.findings.long_limit import (
    BEYOND_HARMONIC,
    describe_limits,
    scaled_speed,
    slope_limits,
    slow_long_chains,
)
from chaincor.workflows.reproduce.findings.low_speed import lj_increases
from chaincor.workflows.reproduce.findings.speeds import minima
from chaincor.workflows.reproduce.measurements import Measurements


@dataclass(frozen=True)
class Remark:
    """A question, in one line, and the answer of the data, with numbers."""

    question: str
    answer: str


def remarks(measured: Measurements, flights: tuple[FreeFlight, ...]) -> tuple[Remark, ...]:
    """Return what is found beyond the paper, in the order of the figures."""
    return (
        Remark(
            "Does dissipation vanish in long chains at some speed v₀ > 0?", _long_chains(measured)
        ),
        Remark("What becomes of C in the limit n → ∞?", _slope_limit(measured)),
        Remark("Where does the lost energy sit?", _spectra(flights)),
        Remark("When do lj chains break?", _breaking(flights)),
        Remark("Which restitution is meant?", _kinematic(measured)),
    )


def _long_chains(measured: Measurements) -> str:
    laws = {speed: found for speed, found in last_exponents(measured).items() if len(found[1]) > 1}
    if not laws:
        return "Too few lengths to say."
    parts = [
        f"{format_value(1.0 - points[-1].restitution, points[-1].error)} at {speed:g} v* "
        f"(n = {points[-1].particles}; exponent from n = {points[0].particles} on "
        f"{law.exponent:z.3f})"
        for speed, (law, points) in laws.items()
    ]
    ends = [(points[0].particles, points[-1].particles) for _, points in laws.values()]
    longest, factors = [last for _, last in ends], [last / first for first, last in ends]
    # By the harmonic law 1 - eta itself would fall by these shares.
    expected = [1.0 - factor ** (-2.0 / 3.0) for factor in factors]
    both = [falls(points) for _, points in laws.values()]
    falling = any(2.0 * ours > share for (ours, _), share in zip(both, expected, strict=True))
    answer = "At some of these speeds it still falls" if falling else "No sign that it does"
    rest = (
        " What still falls is no more than the vanishing harmonic part."
        if all(ours <= harmonic for ours, harmonic in both)
        else ""
    )
    return (
        f"{answer}, up to n = {min(longest)} to {max(longest)}: over the last factor of "
        f"{min(factors):.2g} to {max(factors):.2g} in n, 1 − η changes by "
        f"{_percent([-ours for ours, _ in both])}, where by the harmonic law, of exponent −2/3, it "
        f"would by {_percent([-share for share in expected])}.{rest} Exponents are not exactly 0, "
        "and bars of fits to "
        "three or four points are formal. 1 − η of the longest chains: "
        + "; ".join(parts)
        + ". A slow chain looks harmonic until (v₀/v*) n^(2/3) is about 1 (see [the figure of C]"
        "(#slope))."
    )


def _percent(shares: list[float]) -> str:
    low, high = (f"{100.0 * share:+.1f}" for share in (min(shares), max(shares)))
    return f"{low} to {high} %"


def _slope_limit(measured: Measurements) -> str:
    peaks = [
        f"{float(np.max(increase.values / increase.speeds)):.2f} (n = {n})"
        for n, increase in lj_increases(measured).items()
    ]
    return (
        "In an infinite chain the harmonic part is gone and C is the limit of (1 − η)/(v₀/v*) as "
        "v₀ → 0, taken after n → ∞. It depends on which points a straight line is put through, by "
        "more than the bars of the fits: C is "
        + describe_limits(slope_limits(measured))
        + f". {_checked(measured)} The paper has 0.66 and 2.61, and says that the two disagree: "
        "our numbers agree with it on that, and with the dropped factor put back the theory gives "
        f"{low_speed_dissipation_slope(pair_interval_slope(LennardJones())):.2f}, further still "
        "from every simulated value. Largest (η_harmonic − η)/(v₀/v*) at one length: "
        + ", ".join(peaks)
        + "."
    )


def _checked(measured: Measurements) -> str:
    """Say how many of the points of the limit LAMMPS has as well."""
    points = [p for p in slow_long_chains(measured) if scaled_speed(p) >= BEYOND_HARMONIC[0]]
    checked = [p for p in points if p.agrees is not None]
    longest = max((p.particles for p in checked), default=0)
    return (
        f"Of the {len(points)} points, {len(checked)} are by LAMMPS as well (to n = {longest}), "
        "the others by the in-house engine alone."
    )


def _spectra(flights: tuple[FreeFlight, ...]) -> str:
    whole = [f for f in flights if f.is_whole]
    broken = [f for f in flights if f.separation > 0.0]
    parts = []
    if whole:
        fastest = max(
            (f for f in whole if f.point.speed < 1.0), key=lambda f: f.point.speed, default=whole[0]
        )
        chosen = [whole[0]] if fastest is whole[0] else [whole[0], fastest]
        parts.append(
            "In slow chains in vibration, from the longest waves to short ones: half of the "
            f"kinetic energy of internal motion, mean over {AVERAGED_OVER:g} crossings, is in the "
            "modes up to "
            + ", ".join(
                f"j = {half_of_kinetic(f)} of {f.point.particles - 1} at {f.point.speed:.3g} v*"
                for f in chosen
            )
            + " ([the figure](#mode_spectra))"
        )
    if broken:
        most = max(broken, key=lambda f: f.separation)
        parts.append(
            f"in faster ones also in pieces that fly apart: {most.separation:.3f} of the energy at "
            f"impact at {most.point.speed:.3g} v*, of {1.0 - most.point.restitution:.3f} that are "
            f"lost ({LAST:g} crossings after the last contact)"
        )
    return "; ".join(parts) + "."


def _breaking(flights: tuple[FreeFlight, ...]) -> str:
    if all(f.is_whole for f in flights):
        return "None of these did."
    most = max(flights, key=lambda f: f.pieces_at(LAST)[1])
    fewest, largest = most.pieces_at(LAST)
    count = f"{largest}" if fewest == largest else f"{fewest} or {largest}"
    return (
        f"{describe_breaking(flights)} Most, {count}, there are at {most.point.speed:.3g} v* after "
        f"{LAST:g} crossings (n = {most.point.particles}; [the figure]"
        "(#breaking_and_two_restitutions)). A chain that is left with more inner energy than a "
        "bond takes goes on losing pieces: there is no last moment to count them at."
    )


def _kinematic(measured: Measurements) -> str:
    lows = ", ".join(
        f"η = {low.value:.3f}, e = {low.value**0.5:.3f} ({name})"
        for name, low in minima(measured).items()
    )
    return (
        f"η is a ratio of energies; e = √η, of speeds, is what others print. At the minima: {lows}."
    )
