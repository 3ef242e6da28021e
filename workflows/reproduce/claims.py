"""The claims of the paper, in its order: one table, nothing hidden; for margins see `rules`."""

import math
from typing import TypedDict

from chaincor.workflows.reproduce.rules import Put, Rule


class _Scale(TypedDict):
    scale: float
    scale_name: str


_LOSS: _Scale = {"scale": 0.03, "scale_name": "0.03, what such a chain of 100 loses"}
_FALL: _Scale = {"scale": 0.3, "scale_name": "0.3, by which η falls in figure 4"}
_POWER: _Scale = {"scale": 2.0 / 3.0, "scale_name": "2/3, the power that it is told from"}
_MEAN: _Scale = {"scale": 1.0, "scale_name": "their mean"}

RULES = (
    # ---- harmonic chains
    Rule(
        "independence of v0",
        "section II",
        "η of a harmonic chain does not depend on v₀",
        0.0,
        Put.EXACT,
        **_LOSS,
    ),
    Rule("contact time", "section II", "contact time t_c is almost 2τ for large n", 2.0, Put.WORDS),
    Rule(
        "constant intervals",
        "section II, before eq. (7)",
        "Δt constant in good approximation: deviation 0",
        0.0,
        Put.WORDS,
        **_MEAN,
    ),
    Rule(
        "constant speeds",
        "section II, before eq. (7)",
        "v constant in good approximation: deviation 0",
        0.0,
        Put.WORDS,
        **_MEAN,
    ),
    Rule(
        "interval",
        "eq. (8)",
        "Δt = 2.31/ω at n = 500",
        2.31,
        Put.DIGITS,
        unit=0.01,
        correction="the mean interval is {value:.3f}",
    ),
    Rule(
        "contacts per particle",
        "eq. (9)",
        "f(n)/n = 0.867 at n = 500",
        0.867,
        Put.DIGITS,
        unit=0.001,
        correction="there are a few more contacts: {value:.3f}",
    ),
    Rule("incoming speed", "eq. (10)", "v = 1.15 v₀ at n = 500", 1.15, Put.DIGITS, unit=0.01),
    Rule(
        "leading order",
        "section II, after eq. (11)",
        "leading order of eq. (11) in eq. (7): η = 1",
        1.0,
        Put.EXACT,
    ),
    Rule(
        "harmonic exponent",
        "eq. (12)",
        "1 − η ∝ n^(−2/3) agrees very well",
        -2.0 / 3.0,
        Put.WORDS,
    ),
    Rule(
        "harmonic prefactor",
        "eq. (12)",
        "1 − η = 0.652 n^(−2/3) agrees very well",
        0.652,
        Put.WORDS,
    ),
    Rule(
        "formula prefactor",
        "eq. (12)",
        "0.652 follows from eqs. (7)–(11)",
        0.652,
        Put.DIGITS,
        unit=0.001,
    ),
    # ---- restitution against speed
    Rule("low-speed limit", "section III", "η → η(harmonic) at low speed", 0.0, Put.WORDS, **_FALL),
    Rule(
        "place of the minimum",
        "section III, abstract",
        "minimum of η near v₀/v* = 1",
        1.0,
        Put.WORDS,
        correction="it is at {value:.2f} v* on average",
    ),
    Rule(
        "collapse lj toda",
        "section III, figure 4",
        "lj and toda: almost the same curve η(v/v*)",
        0.0,
        Put.WORDS,
        **_FALL,
    ),
    Rule(
        "collapse lj log",
        "section III, figure 4",
        "log too: almost the same curve up to 0.9 v*",
        0.0,
        Put.WORDS,
        correction="log follows only within {value:.3f}",
        **_FALL,
    ),
    Rule(
        "collapse lj log, fast",
        "section III, figure 4; IV",
        "log too: almost the same curve from 0.9 to 2 v*",
        0.0,
        Put.WORDS,
        correction="log leaves the curve by {value:.3f}",
        **_FALL,
    ),
    Rule("high-speed limit", "section III", "η → 1 at high speed", 1.0, Put.WORDS, **_FALL),
    Rule(
        "contacts at high speed",
        "section III, figure 7",
        "f(n)/n → 1 at high speed",
        1.0,
        Put.WORDS,
    ),
    Rule(
        "rise of contacts",
        "figure 7",
        "f(n)/n and η rise at v₀/v* ≈ 1",
        1.0,
        Put.WORDS,
        correction="f(n)/n is half-way up at {value:.2f} v*",
    ),
    Rule("hard spheres", "section III", "hard spheres: η = 1 exactly", 1.0, Put.EXACT),
    Rule(
        "hard-sphere contacts", "section III", "hard spheres: n contacts (as f/n)", 1.0, Put.EXACT
    ),
    # ---- long chains
    Rule(
        "long chains, fast",
        "section III, figure 5",
        "1 − η at 0.78 v* tends to a constant (exponent 0)",
        0.0,
        Put.WORDS,
        **_POWER,
    ),
    Rule(
        "long chains, slow",
        "section III, figure 5",
        "1 − η at 0.008 v* vanishes in long chains (exponent −2/3)",
        -2.0 / 3.0,
        Put.WORDS,
        correction="it falls as n^({value:.2f}): a constant",
    ),
    # ---- low speed
    Rule(
        "external frequency",
        "section III",
        "wall's frequency 2π/Δt ≃ 2√2 ω, above all modes",
        2.0 * math.sqrt(2.0),
        Put.WORDS,
    ),
    Rule(
        "alpha",
        "eq. (15)",
        "n = 2, lj: α = 0.808",
        0.808,
        Put.DIGITS,
        unit=0.001,
        correction="α = {value:.4f}",
    ),
    Rule(
        "theoretical slope",
        "eq. (18)",
        "theory: C = 32α/π² = 2.61",
        2.61,
        Put.DIGITS,
        unit=0.01,
        correction="with the factor v²/v₀² = π²/8 that was dropped, C = 4α = {value:.2f}",
    ),
    Rule(
        "simulated slope",
        "section III",
        "simulation: C = 0.66",
        0.66,
        Put.DIGITS,
        unit=0.01,
        correction="{value:.2f} at n = 100; there is no single C: it depends on n and on the range",
    ),
    *(
        Rule(
            f"power r = {order}",
            "eq. (20)",
            f"increase ∝ v^(r−2), r = {order}, agrees at low speed",
            order - 2.0,
            Put.WORDS,
        )
        for order in (3, 4, 5)
    ),
    *(
        Rule(
            f"printed power r = {order}",
            "figure 6",
            f"fitted slope {slope} for r = {order}",
            slope,
            Put.DIGITS,
            unit=0.01,
            correction="{value:.2f} from 0.01 to 0.1 v*; the paper does not say its range",
        )
        for order, slope in ((3, 1.34), (4, 2.09), (5, 3.14))
    ),
)
