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
        Reading("What do the three middle speeds of figure 5 say?", _middle_speeds(measured)),
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
            "text speaks of v ≪ 1.",
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
        f"are at {_span([low.place for low in lows.values()])} v*, but at "
        f"{_span(list(places.values()))} speeds of sound: only in v* are they one curve. "
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
            "on"
        )
    return (
        "The paper plots them without a word, so there is no verdict. They level off as the "
        "fastest does: " + "; ".join(parts) + "."
    )
