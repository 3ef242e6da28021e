"""Judge numbers in section II that no figure shows: contacts, and quantities independent of v0."""

from collections.abc import Callable
from functools import wraps

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.theory import basile_dumont_energies
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.reproduce.claims import ClaimFinding, claim, digits, exact, words
from chaincor.workflows.reproduce.measurements import (
    Answer,
    MeasuredPoint,
    Measurements,
    NoNumber,
    column,
)
from chaincor.workflows.reproduce.plan import ReproductionPlan, Study, harmonic_chains

# The paper's numbers in brackets come from a chain of this length.
PAPER_CHAIN = 500


def study(plan: ReproductionPlan) -> Study:
    """Return the scenes of one harmonic chain at many velocities."""
    tolerance = 0.1 * plan.tolerance
    scenes = harmonic_chains((plan.curve_particles,), tolerance, plan.harmonic_velocities)
    return Study("harmonic_velocities", "harmonic chain at many velocities", scenes)


def _by_lammps(measured: Measurements) -> tuple[list[MeasuredPoint], str]:
    """Return the points that LAMMPS computed at many velocities, and a description of them."""
    points = measured.select("harmonic_velocities", "harmonic")
    ours = [p for p in points if p.source == "lammps"]
    if len(ours) < 2:
        raise NoNumber("fewer than two velocities")
    velocities = [p.scene.impact_velocity for p in ours]
    return ours, (
        f"between {len(ours)} velocities from {min(velocities):g} to {max(velocities):g} speeds of "
        f"sound, n = {ours[0].particles}, LAMMPS"
    )


# The scale of the error is the dissipation of a harmonic chain of 100 particles.
@claim(
    "section II",
    exact(0.0, 0.03),
    "harmonic η does not depend on v₀",
    text="η of a harmonic chain does not depend on v₀: differences are 0",
)
def _independence_of_v0(measured: Measurements) -> ClaimFinding:
    ours, where = _by_lammps(measured)
    return ClaimFinding(
        float(np.ptp(column(ours, "restitution"))),
        2.0 * max(p.error for p in ours),
        f"largest difference of η {where}",
        measured.select("harmonic_velocities", "harmonic"),
    )


def difference_over_velocities(
    measured: Measurements, name: str, quantity: Callable[[MeasuredPoint, Answer], ArrayLike]
) -> ClaimFinding:
    """
    Find how much a quantity varies with the velocity of a chain although it should not.

    Because the quantity has no error bar, the difference between the engines is its error.
    """
    ours, where = _by_lammps(measured)
    both = [[quantity(p, a) for a in p.answers] for p in ours if len(p.answers) == 2]
    if len(both) < 2:
        raise NoNumber("no reference result to compare with")
    by_lammps, reference = (np.array(values) for values in zip(*both, strict=True))
    return ClaimFinding(
        float(np.max(np.ptp(by_lammps, axis=0))),
        2.0 * float(np.max(np.abs(by_lammps - reference))),
        f"largest difference of {name} {where}; ± twice the largest difference between the engines",
        ours,
    )


# The scale of the error is t_c/τ, which is about 2.
@claim(
    "section II",
    exact(0.0, 2.0),
    "harmonic contact time does not depend on v₀",
    text="t_c of a harmonic chain does not depend on v₀: differences of t_c/τ are 0",
)
def _independence_of_contact_time(measured: Measurements) -> ClaimFinding:
    return difference_over_velocities(
        measured, "t_c/τ", lambda p, a: a.result["last_contact_time"] / (p.particles - 1.0)
    )


# The scale of the error is the largest E_j/E of a harmonic chain of 100 particles.
@claim(
    "section II",
    exact(0.0, 0.001),
    "harmonic mode energies E_j/E do not depend on v₀",
    text="E_j/E of a harmonic chain does not depend on v₀ for any mode: differences are 0",
)
def _independence_of_modes(measured: Measurements) -> ClaimFinding:
    return difference_over_velocities(
        measured, "E_j/E of any mode", lambda p, a: a.arrays["mode_energies"][1:] / p.energy
    )


def paper_chain(measured: Measurements) -> MeasuredPoint:
    """Return the chain behind the paper's numbers in brackets; raise NoNumber without a result."""
    missing = f"no result at n = {PAPER_CHAIN}"
    return measured.select("harmonic_sizes", "harmonic", 1, missing, particles=PAPER_CHAIN)[0]


def number_of_paper_chain(
    quantity: Callable[[MeasuredPoint, Array, Array], tuple[float, str]],
) -> Callable[[Measurements], ClaimFinding]:
    """
    Find a number for the chain behind the paper's numbers in brackets.

    `quantity` is a function with three arguments: the chain, the intervals between its contacts in
    units of 1/omega, and the incoming speeds in units of v0. It returns the number and a
    description. Because the number has no error bar, the difference between the engines is its
    error.
    """

    @wraps(quantity)
    def find(measured: Measurements) -> ClaimFinding:
        point = paper_chain(measured)

        def found(answer: Answer) -> tuple[float, str]:
            speeds = answer.arrays["contact_speeds"] / point.scene.impact_velocity
            return quantity(point, np.diff(answer.arrays["contact_times"]), speeds)

        value, text = found(point.answer)
        both = [found(answer)[0] for answer in point.answers]
        error = abs(both[0] - both[1]) if len(both) == 2 else np.nan
        return ClaimFinding(value, error, text, [point])

    return find


_CONSTANT = words(0.0, 1.0, "their mean")


@claim(
    "section II, before eq. (7)",
    _CONSTANT,
    "constant intervals",
    text="Δt constant in good approximation: deviation 0",
)
@number_of_paper_chain
def _constant_intervals(
    point: MeasuredPoint, intervals: Array, _speeds: Array
) -> tuple[float, str]:
    return float(np.std(intervals) / np.mean(intervals)), (
        f"standard deviation over mean of {intervals.size} intervals, {point.origin}; ± what the "
        f"engines differ by; the last is {intervals[-1]:.2f}"
    )


@claim(
    "section II, before eq. (7)",
    _CONSTANT,
    "constant incoming speeds",
    text="v constant in good approximation: deviation 0",
)
@number_of_paper_chain
def _constant_speeds(point: MeasuredPoint, _intervals: Array, speeds: Array) -> tuple[float, str]:
    return float(np.std(speeds) / np.mean(speeds)), (
        f"standard deviation over mean of {speeds.size} incoming speeds, {point.origin}; ± what "
        f"the engines differ by; the last is {speeds[-1]:.2f} v₀"
    )


def _chain_of_two(measured: Measurements) -> tuple[MeasuredPoint, float, float]:
    """Return the chain of two, the interval between its contacts, and the engines' difference."""
    missing = "no result at n = 2"
    chain = measured.select("harmonic_sizes", "harmonic", 1, missing, particles=2)[0]
    times = chain.answer.arrays["contact_times"]
    if len(times) != 2:
        raise NoNumber(missing)
    interval = float(times[1] - times[0])
    both = [float(np.ptp(answer.arrays["contact_times"])) for answer in chain.answers]
    return chain, interval, 1e-9 + max(abs(each - interval) for each in both)


@claim(
    "eq. (8)",
    digits("2.22"),
    "Δt = 2.22/ω of the chain of two",
    text="estimate from n = 2: Δt = π/(√2 ω) = 2.22/ω",
)
def _interval_of_two(measured: Measurements) -> ClaimFinding:
    chain, interval, error = _chain_of_two(measured)
    return ClaimFinding(
        interval,
        error,
        f"interval between the two contacts, {chain.origin}; ± difference between the engines",
        [chain],
    )


@claim(
    "eq. (8)",
    digits("2.31"),
    "Δt = 2.31/ω",
    text="Δt = 2.31/ω at n = 500",
    correction="the mean interval is {value:.3f}",
)
@number_of_paper_chain
def _interval(point: MeasuredPoint, intervals: Array, _speeds: Array) -> tuple[float, str]:
    return float(np.mean(intervals)), (
        f"mean over {intervals.size} intervals, {point.origin}; ± difference between the engines; "
        f"median {np.median(intervals):.4f}"
    )


@claim("eq. (9)", digits("0.90"), "(2√2/π) n is 0.90 n", text="formula (2√2/π) n = 0.90 n for f(n)")
def _contacts_of_two(measured: Measurements) -> ClaimFinding:
    chain, interval, error = _chain_of_two(measured)
    share = 2.0 / interval
    return ClaimFinding(
        share,
        share * error / interval,
        "f Δt = 2n, because contacts last as long as sound travels to the free "
        f"end and back, with Δt of {chain.origin}. This does not follow from n "
        "= 2 alone, see the [slips](#slips)",
        [chain],
    )


@claim(
    "eq. (9)",
    digits("0.867"),
    "f(n)/n = 0.867",
    text="f(n)/n = 0.867 at n = 500",
    correction="there are a few more contacts: {value:.3f}",
)
@number_of_paper_chain
def _contacts_per_particle(
    point: MeasuredPoint, _intervals: Array, speeds: Array
) -> tuple[float, str]:
    return speeds.size / PAPER_CHAIN, (
        f"{speeds.size} contacts, {point.origin}; the paper's 0.867 would be "
        f"{0.867 * PAPER_CHAIN:.1f} contacts, which is not a whole number"
    )


@claim(
    "eq. (10)", digits("1.11"), "(π/2√2) v₀ is 1.11 v₀", text="formula (π/2√2) v₀ = 1.11 v₀ for v"
)
def _speed_of_two(measured: Measurements) -> ClaimFinding:
    chain, interval, error = _chain_of_two(measured)
    return ClaimFinding(
        1.0 / (2.0 / interval),
        error / 2.0,
        "2 f v = 2 n v₀, the momentum of a collision without loss, with that f; "
        f"{chain.origin}, has v = v₀ itself. That it follows from n = 2 alone does not "
        "hold, see the [slips](#slips)",
        [chain],
    )


@claim("eq. (10)", digits("1.15"), "v = 1.15 v₀", text="v = 1.15 v₀ at n = 500")
@number_of_paper_chain
def _incoming_speed(point: MeasuredPoint, _intervals: Array, speeds: Array) -> tuple[float, str]:
    # Momentum conservation gives this mean speed: the momentum changes by n v0 (1 + e) in total,
    # and by 2 v in a contact at speed v.
    momentum = (1.0 + point.restitution**0.5) / (2.0 * speeds.size / PAPER_CHAIN)
    return float(np.mean(speeds)), (
        f"mean over {speeds.size} contacts, {point.origin}; ± difference between the engines; "
        f"momentum conservation gives n(1 + √η)/(2f) = {momentum:.4f}"
    )


@claim(
    "section II, after eq. (11)",
    exact(1.0),
    "η = 1 at leading order",
    text="leading order of eq. (11) in eq. (7): η = 1",
)
def _leading_order(measured: Measurements) -> ClaimFinding:
    # If omega_j = pi j/n in eq. (7), the phase of each mode changes by whole periods during f dt =
    # 2n.
    n = PAPER_CHAIN
    linear = np.pi * np.arange(n) / n
    left = 2.0 / n * np.sum(basile_dumont_energies(n, frequencies=linear))
    chains_own = 2.0 / n * np.sum(basile_dumont_energies(n))
    return ClaimFinding(
        float(1.0 - left),
        1e-12,
        f"eq. (7) summed over j with ω_j = πj/n, n = {n}, and eqs. (8)–(10), ± rounding; "
        f"with the chain's own ω_j it is {1.0 - chains_own:.5f}",
    )
