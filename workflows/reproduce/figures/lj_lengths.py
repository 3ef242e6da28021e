"""Draw the dissipation of long lj chains at a fixed v0/v* against n (NH figure 5)."""

from dataclasses import replace

import numpy as np

from chaincor.analysis.figures.style import GREY
from chaincor.analysis.theory import harmonic_dissipation_law
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.pages.typesetting import format_fitted, format_value
from chaincor.workflows.reproduce.claims import ClaimFinding, claim, words
from chaincor.workflows.reproduce.curve import Curve, fit_rows
from chaincor.workflows.reproduce.drawing import Axes, Figure, draw_curves, point_record
from chaincor.workflows.reproduce.measurements import Measurements, NoNumber, column
from chaincor.workflows.reproduce.plan import PAPER_SIZE_SPEEDS, ReproductionPlan, Study, chains

_KEY = "lj_lengths"
_SLOW = PAPER_SIZE_SPEEDS[-1]
# In slow chains, dissipation becomes constant only at large lengths. The fits therefore use the
# last part of each curve, which begins at the longest length divided by this number.
_LAST_PART = 5.0
# The cost of a LAMMPS run is proportional to n^2 v0/v*. Points with a larger n^2 v0/v* than this
# are left to the reference engine, because in LAMMPS each would take 3 to 8 % of the total time.
_DEAREST = 3e5
# In this range of lengths, slow chains still look harmonic.
_BEFORE = (100, 1000)


def study(plan: ReproductionPlan) -> Study:
    """Return the scenes of lj chains of many lengths at the paper's speeds."""
    near: tuple[Scene, ...] = ()
    dear: tuple[Scene, ...] = ()
    for u in PAPER_SIZE_SPEEDS:
        cheap = [n for n in plan.sizes if n * n * u <= _DEAREST]
        near += chains("lj", cheap, (u,), plan.tolerance)
        dear += chains("lj", [n for n in plan.sizes if n not in cheap], (u,), plan.tolerance)
    for u, sizes in plan.far_sizes.items():
        dear += chains("lj", sizes, (u,), plan.tolerance)
    return Study("sizes", "lj chains of many lengths at five speeds", near, dear)


def _curve(measured: Measurements, speed: float) -> Curve:
    return Curve.of(measured.select("sizes", "lj", speed=speed), "particles", "dissipation")


def _last_parts(measured: Measurements) -> dict[float, Curve]:
    """Return the last part of the curve at each speed, which determines the exponent."""
    curves = {speed: _curve(measured, speed) for speed in PAPER_SIZE_SPEEDS}
    return {
        speed: curve.between(curve.x[-1] / _LAST_PART, np.inf)
        for speed, curve in curves.items()
        if curve.points
    }


@claim(
    "section III, figure 5",
    words(-2.0 / 3.0),
    "1 − η of slow chains vanishes in the limit",
    text='"in very low-velocity collision, as expected from the result for model A, … 1 − η will '
    "approach to zero\" in the thermodynamic limit: read as at a fixed v₀, with model A's exponent "
    "−2/3",
    key="long chains, slow",
    correction="at a fixed v₀ the exponent of the longest chains is {value:.2f}; if v₀ → 0 "
    "too, 1 − η does vanish",
    figure=_KEY,
)
def _long_chains_slow(measured: Measurements) -> ClaimFinding:
    found = _exponent(measured, _SLOW)
    alone = [p.particles for p in found.points if p.agrees is None]
    before = [
        f"; from n = {law.first:.0f} to {law.last:.0f} it does fall, as the paper says (exponent "
        f"{law.exponent:.2f} ± {law.exponent_error:.2f}), and hardly beyond"
        for law in _curve(measured, _SLOW).over([_BEFORE], Curve.power_law)
    ]
    return replace(
        found,
        text=f"{found.text}. We read {_SLOW:g} v*, its slowest speed, as very low, "
        f"and expect the law of model A there{''.join(before)}. The paper's own "
        "eq. (18), which is for n → ∞, gives 1 − η = C v₀/v* > 0 at every v₀: "
        "read as v₀ → 0 as well, the statement holds"
        + (
            f". From n = {min(alone)} on, only the reference engine computed the chains"
            if alone
            else ""
        ),
        brief=f"as we read it: at {_SLOW:g} v* 1 − η stays near "
        f"{found.points[-1].dissipation:.4f}, about C v₀/v*, as the paper's own eq. (18) implies; "
        "it vanishes if v₀ → 0 too",
    )


@claim(
    "section III, figure 5",
    words(0.0, 2.0 / 3.0, "2/3, the power that it is fitted from"),
    "dissipation of fast chains does not vanish in the limit",
    text="near v* 1 − η stays constant in the limit (at 0.78 v*: exponent 0)",
    key="long chains, fast",
    figure=_KEY,
)
def _long_chains_fast(measured: Measurements) -> ClaimFinding:
    return _exponent(measured, PAPER_SIZE_SPEEDS[0])


def _exponent(measured: Measurements, speed: float) -> ClaimFinding:
    parts = _last_parts(measured)
    if speed not in parts:
        raise NoNumber("no points")
    part, law = parts[speed], parts[speed].power_law()
    first, last = (format_value(part.y[end], part.errors[end]) for end in (0, -1))
    harmonic = float(harmonic_dissipation_law(part.x[-1]))
    return ClaimFinding(
        law.exponent,
        law.exponent_error,
        f"exponent of 1 − η against n, {law.points} points, n = {law.first:.0f} to {law.last:.0f}, "
        f"where 1 − η goes from {first} to {last}; the harmonic law ends at {harmonic:.4f}",
        part.points,
    )


def long_chains(measured: Measurements) -> str:
    """Describe at which speeds dissipation vanishes in long chains."""
    parts = {speed: part for speed, part in _last_parts(measured).items() if part.x.size > 1}
    if not parts:
        raise NoNumber("Too few lengths to say.")
    n, longest = np.array([part.x[[0, -1]] for part in parts.values()]).T
    lost, left = np.array([part.y[[0, -1]] for part in parts.values()]).T
    fall = (lost - left) / lost
    # The measured decrease is compared with the decrease of the harmonic part, and with that of 1 -
    # eta according to the harmonic law.
    harmonic = (harmonic_dissipation_law(n) - harmonic_dissipation_law(longest)) / lost
    expected = 1.0 - (longest / n) ** (-2.0 / 3.0)
    falling = np.any(2.0 * fall > expected)
    answer = "At some of these speeds it still falls" if falling else "No sign that it does"
    vanishing = " The remaining fall is no more than the vanishing harmonic part."
    ends = "; ".join(
        f"{format_value(part.y[-1], part.errors[-1])} at {speed:g} v* (n = {part.x[-1]:.0f}; "
        f"exponent from n = {part.x[0]:.0f} on {part.power_law().exponent:z.3f})"
        for speed, part in parts.items()
    )
    return (
        f"{answer}, up to n = {min(longest):.0f} to {max(longest):.0f}: over the last factor of "
        f"{min(longest / n):.2g} to {max(longest / n):.2g} in n, 1 − η changes by "
        f"{_percent(-fall)}, where by the harmonic law, of exponent −2/3, it would by "
        f"{_percent(-expected)}.{vanishing if np.all(fall <= harmonic) else ''} Exponents are not "
        "exactly 0, and bars of fits to three or four points are formal. 1 − η of the longest "
        f"chains: {ends}. A slow chain looks harmonic until (v₀/v*) n^(2/3) is about 1 (see [the "
        "figure of C](#slope))."
    )


def _percent(shares: Array) -> str:
    return f"{100.0 * min(shares):+.1f} to {100.0 * max(shares):+.1f} %"


def middle_speeds(measured: Measurements) -> str:
    """Describe the results at the speeds that the paper plots without comment."""
    parts = [
        f"at {speed:g} v* 1 − η = {part.y[-1]:.4f} at n = {part.x[-1]:.0f}, exponent "
        f"{part.power_law().exponent:z.2f} from n = {part.x[0]:.0f} to {part.x[-1]:.0f}"
        for speed, part in _last_parts(measured).items()
        if speed in PAPER_SIZE_SPEEDS[1:-1]
    ]
    return (
        "The paper plots these curves without comment, so there is no verdict. "
        "They change by a few per cent at most: " + "; ".join(parts) + "."
    )


def figure(measured: Measurements) -> Figure:
    """Return the figure of 1 - eta against n for lj and harmonic chains."""
    laws = {speed: part.power_law() for speed, part in _last_parts(measured).items()}
    curves = {speed: _curve(measured, speed) for speed in PAPER_SIZE_SPEEDS}
    harmonic = [p for p in measured.select("harmonic_sizes", "harmonic") if p.particles >= 10]

    def draw(ax: Axes) -> None:
        x, y = column(harmonic, "particles"), column(harmonic, "dissipation")
        ax.plot(x, y, ".", color=GREY, markersize=2.5, label="harmonic")
        draw_curves(ax, {rf"$v_0 = {speed:.3f}\,v^*$": curve for speed, curve in curves.items()})
        ax.set(xscale="log", yscale="log", xlabel=r"number of particles $n$")
        ax.set_ylabel(r"dissipation $1-\eta$")
        ax.legend(loc="lower left", ncols=2)

    return Figure(
        key=_KEY,
        title="Dissipation of Lennard-Jones chains against their length, at five speeds",
        caption=(
            "The paper's figure 5, extended to longer chains. Filled: LAMMPS; "
            "open: reference engine. Grey: the harmonic chain, whose dissipation "
            "vanishes as n^(−2/3). A curve that levels off stays finite in the "
            "limit of long chains, and all curves level off here. Exponent of 1 − "
            "η from a fifth of the longest chain on: "
            + ", ".join(
                f"{format_fitted(law.exponent, law.exponent_error)} at {speed:.3f} v* "
                f"({law.points} points to n = {law.last:.0f})"
                for speed, law in laws.items()
            )
            + ". Error bars of fits to three or four points contain only their "
            "scatter and are formal."
        ),
        alt=(
            "1 − η against n at five speeds: flat at 0.78, 0.39 and 0.16 v*; falling and then flat "
            "at 0.078 and 0.008 v*, while the harmonic chain goes on falling."
        ),
        draw=draw,
        records=[point_record(p) for curve in curves.values() for p in curve.points],
        fits=fit_rows("n", {f"1 − η, lj, {u:g} v*": [law] for u, law in laws.items()}),
        size=(6.4, 4.4),
    )
