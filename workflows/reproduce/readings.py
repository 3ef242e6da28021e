"""How the paper was read, and what in it can be measured but not judged."""

from dataclasses import dataclass

import numpy as np

from chaincor.workflows.reproduce.findings.lengths import last_exponents
from chaincor.workflows.reproduce.findings.speeds import minima
from chaincor.workflows.reproduce.measurements import Measurements
from chaincor.workflows.reproduce.plan import PAPER_SIZE_SPEEDS
from chaincor.workflows.reproduce.studies import CURVE_POTENTIALS


@dataclass(frozen=True)
class Reading:
    """A question that the paper leaves open, and how it is taken here, with numbers."""

    question: str
    answer: str


def readings(measured: Measurements) -> tuple[Reading, ...]:
    """Return how the paper was read."""
    return (
        Reading("Does v₀ in its figures mean v₀/v*?", _unit_of_speed(measured)),
        Reading(
            "What is the v of its formulas?",
            "In section II the speed at which particle 1 comes to the wall. In eqs. (16) to (20) "
            "the tilde of v₀/v* is dropped soon: v ≪ 1, C v and v > 1 are in units of v*, and C is "
            "(1 − η)/(v₀/v*). This report writes v₀/v* there.",
        ),
        Reading(
            "In eqs. (18) and (20), is it 1 − η or its increase?",
            "The increase over the harmonic chain of the same length, as figure 6 plots it. They "
            "are derived for n → ∞, where the harmonic chain loses nothing and both are the same; "
            f"at n = {measured.plan.curve_particles} a slow chain loses {_harmonic_loss(measured)} "
            "for being harmonic alone.",
        ),
        Reading(
            "How long are its chains?",
            f"It says 100 for figure 4 only. Figures 6 and 7 are computed here with "
            f"n = {measured.plan.curve_particles} as well; for C = 0.66, which depends on the "
            "length, with several.",
        ),
        Reading("What do the three middle speeds of figure 5 say?", _middle_speeds(measured)),
        Reading(
            "Which of its statements have no verdict?",
            "That vibration is rapidly damped progressively into the chain, particle 1 having the "
            "largest amplitude (of what, is not defined); that Δt shortens with speed (its power "
            "is judged); that hard-core behaviour is the cause of η → 1; that at high speed real "
            "bodies deform instead; those on other models and experiments in section I (two are "
            "among the [slips](#slips)).",
        ),
        Reading(
            "Were its figures compared point by point?",
            "No. This report knows the paper's text, formulas and captions; verdicts are on the "
            "numbers and words in them. Our figures show the same quantities, for readers who "
            "have the paper beside them.",
        ),
        Reading(
            "Over which ranges did it fit?",
            "It does not say, neither for C = 0.66 nor for the slopes of figure 6. One decade is "
            "taken for all of them, from 0.01 to 0.1 v*: its slowest speed is 0.008 v*, and its "
            "text speaks of v ≪ 1. The halves of that decade, and going on to the "
            "fastest speed computed, tell how much depends on it.",
        ),
    )


def _unit_of_speed(measured: Measurements) -> str:
    lows = minima(measured)
    scales = {name: measured.select("curves", name) for name in CURVE_POTENTIALS}
    places = {
        name: lows[name].place * points[0].scene.impact_velocity / points[0].speed
        for name, points in scales.items()
        if points
    }
    lj = scales["lj"]
    answer = (
        'Section III begins with "we discuss the velocity dependence on the scale of v*", but '
        "captions print v₀ = 0.780 and text v = 1. Read as v₀/v*: minima of the three potentials "
        f"are at {_span([low.place for low in lows.values()])} v*, but they are at "
        f"{_span(list(places.values()))} speeds of sound: only in v* are the minima at nearly the "
        "same place, and are lj and toda one curve. "
    )
    if lj:
        scale = lj[0].scene.impact_velocity / lj[0].speed
        absolute = [u / scale for u in PAPER_SIZE_SPEEDS]
        speeds = np.log([p.speed for p in lj])
        lost = np.interp(np.log(absolute), speeds, [1.0 - p.restitution for p in lj])
        answer += (
            "Read as speeds of sound, the five speeds of figure 5 would be "
            + ", ".join(f"{u:.2g}" for u in absolute)
            + " v*, where 1 − η of lj chains (n = "
            f"{lj[0].particles}) is "
            + ", ".join(f"{y:.3f}" for y in lost)
            + ": the fastest would lose least, against the text, which has a constant there. So v₀ "
            "is taken as v₀/v* throughout."
        )
    return answer


def _harmonic_loss(measured: Measurements) -> str:
    chains = measured.select("harmonic_velocities", "harmonic")
    return f"{1.0 - chains[0].restitution:.4f}" if chains else "–"


def _span(values: list[float]) -> str:
    return f"{min(values):.2f} to {max(values):.2f}" if values else "–"


def _middle_speeds(measured: Measurements) -> str:
    laws = last_exponents(measured)
    parts = []
    for speed in PAPER_SIZE_SPEEDS[1:-1]:
        law, points = laws[speed]
        if not points:
            continue
        parts.append(
            f"at {speed:g} v* 1 − η = {1.0 - points[-1].restitution:.4f} at n = "
            f"{points[-1].particles}, exponent {law.exponent:z.2f} from n = {points[0].particles} "
            f"to {points[-1].particles}"
        )
    return (
        "The paper plots them without a word, so there is no verdict. They change by a few per "
        "cent at most: " + "; ".join(parts) + "."
    )
