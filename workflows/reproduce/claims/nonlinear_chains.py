"""Claims of the paper's section III, nonlinear chains."""

import math
from typing import TypedDict

from chaincor.workflows.reproduce.rules import Put, Rule


class _Scale(TypedDict):
    scale: float
    scale_name: str


# Of differences and limits: how much the quantity changes along our curve of lj chains.
_FALL: _Scale = {"scale": 0.26, "scale_name": "0.26, by which η of lj chains falls (here)"}
_HARMONIC: _Scale = {"scale": 0.0275, "scale_name": "0.0275, what the harmonic chain loses"}
_RISE: _Scale = {"scale": 0.16, "scale_name": "0.16, by which f(n)/n of lj chains rises (here)"}
_POWER: _Scale = {"scale": 2.0 / 3.0, "scale_name": "2/3, the power that it is told from"}

NONLINEAR_CLAIMS = (
    # ---- against speed
    Rule(
        "low-speed limit",
        "section III",
        "η → η of the harmonic chain as v₀ → 0: difference 0 in the limit",
        0.0,
        Put.WORDS,
        **_HARMONIC,
        brief="slow chains are harmonic",
        figure="restitution_curves",
    ),
    Rule(
        "place of the minimum",
        "sections III and IV",
        "minimum of η near v₀/v* = 1 (the abstract: at a certain velocity)",
        1.0,
        Put.WORDS,
        correction="it is at {value:.2f} v* on average",
        brief="the minimum of η at v*",
        figure="restitution_curves",
    ),
    Rule(
        "one curve",
        "section III, figure 4; section IV",
        "η of lj, toda and log lies on almost the same curve: differences are 0",
        0.0,
        Put.WORDS,
        correction="they are up to {value:.3f} apart: log leaves the curve of the others",
        **_FALL,
        brief="one curve η(v₀/v*) for all three bonds",
        figure="restitution_curves",
    ),
    # ---- long chains
    Rule(
        "long chains, slow",
        "section III, figure 5",
        '"in very low-velocity collision, as expected from the result for model A, … 1 − η will '
        "approach to zero\" in the thermodynamic limit: read as at a fixed v₀, with model A's "
        "exponent −2/3",
        -2.0 / 3.0,
        Put.WORDS,
        correction="at a fixed v₀ the exponent of the longest chains is {value:.2f}; if v₀ → 0 "
        "too, 1 − η does vanish",
        brief="1 − η of slow chains vanishes in the limit",
        figure="lj_lengths",
    ),
    Rule(
        "long chains, fast",
        "section III, figure 5",
        "near v* 1 − η stays constant in the limit (at 0.78 v*: exponent 0)",
        0.0,
        Put.WORDS,
        **_POWER,
        brief="dissipation of fast chains does not vanish in the limit",
        figure="lj_lengths",
    ),
    # ---- low speed
    Rule(
        "external frequency",
        "section III",
        "wall's frequency 2π/Δt ≃ 2√2 ω, above all modes",
        2.0 * math.sqrt(2.0),
        Put.WORDS,
        brief="the wall's frequency",
    ),
    Rule(
        "alpha",
        "eq. (15)",
        "n = 2, lj: α = 0.808",
        0.808,
        Put.DIGITS,
        unit=0.001,
        correction="α = {value:.4f}",
        brief="α = 0.808",
        figure="pair",
    ),
    Rule(
        "printed constant",
        "eq. (18)",
        "C = 32α/π² = 2.61",
        2.61,
        Put.DIGITS,
        unit=0.01,
        correction="it is {value:.2f} with the paper's own α",
        brief="C = 32α/π² = 2.61",
    ),
    Rule(
        "theoretical slope",
        "eq. (18)",
        "C = 2.61 follows from eqs. (7)–(10) and (15)",
        2.61,
        Put.DIGITS,
        unit=0.01,
        correction="with the factor v²/v₀² = π²/8 that was dropped, C = 4α = {value:.2f}",
        brief="how C = 2.61 is derived",
    ),
    Rule(
        "simulated slope",
        "section III",
        "simulation: C = 0.66",
        0.66,
        Put.DIGITS,
        unit=0.01,
        correction="{value:.2f} at n = 100",
        unsaid="over which range of speeds, nor for which length",
        brief="C = 0.66 of the simulation",
        figure="slope",
    ),
    Rule(
        "not in accord",
        "after eq. (18)",
        '"the constant C is not in accord": theory and simulation disagree',
        1.0,
        Put.TREND,
        brief="theory and simulation disagree on C, as the authors say",
        figure="slope",
    ),
    Rule(
        "power lj",
        "after eq. (18)",
        "1 − η ∝ v^p, p = 1, agrees with simulation at low speed (lj)",
        1.0,
        Put.WORDS,
        brief="dissipation of lj chains grows as v₀",
        figure="slope",
    ),
    Rule(
        "power of other types",
        "after eq. (18)",
        '"the exponent is the same for other types of chains": p = 1 for toda and log',
        1.0,
        Put.WORDS,
        brief="that of toda and log chains too",
        figure="restitution_curves",
    ),
    *(
        Rule(
            f"contact time r = {order}",
            "before eq. (20)",
            f"contact time shortens as v₀^(r−2), r = {order}",
            order - 2.0,
            Put.WORDS,
            brief=f"contact time shortens as v₀^(r−2), r = {order}",
        )
        for order in (3, 4, 5)
    ),
    *(
        Rule(
            f"power r = {order}",
            "eq. (20)",
            f"increase ∝ (v₀/v*)^(r−2), r = {order}, agrees at low speed",
            order - 2.0,
            Put.WORDS,
            brief=f"dissipation grows as v₀^(r−2), r = {order}",
            figure="increase",
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
            correction="{value:.2f} from 0.01 to 0.1 v*",
            unsaid="over which range of speeds",
            brief=f"slope {slope} of figure 6",
            figure="increase",
        )
        for order, slope in ((3, 1.34), (4, 2.09), (5, 3.14))
    ),
    # ---- high speed
    Rule(
        "hard spheres",
        "section III",
        "hard spheres: η = 1 exactly",
        1.0,
        Put.EXACT,
        brief="hard spheres lose nothing",
    ),
    Rule(
        "hard-sphere contacts",
        "section III",
        "hard spheres: n contacts (as f/n)",
        1.0,
        Put.EXACT,
        brief="hard spheres have n contacts",
    ),
    Rule(
        "rise of both",
        "figure 7",
        "both f(n)/n and η increase at v₀/v* ≈ 1",
        1.0,
        Put.TREND,
        brief="f(n)/n and η both rise at v*",
        figure="contacts_and_restitution",
    ),
    Rule(
        "contacts at high speed",
        "section III, figure 7",
        "f(n)/n → 1 at high speed",
        1.0,
        Put.WORDS,
        **_RISE,
        brief="f(n)/n → 1 at high speed",
        figure="contacts_and_restitution",
    ),
    Rule(
        "high-speed limit",
        "section III",
        "η → 1 at high speed",
        1.0,
        Put.WORDS,
        **_FALL,
        brief="η → 1 at high speed",
        figure="restitution_curves",
    ),
)
