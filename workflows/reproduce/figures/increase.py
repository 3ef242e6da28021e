"""Draw how dissipation increases with speed for bonds of order 3, 4 and 5 (NH figure 6)."""

from typing import Any

import numpy as np

from chaincor.analysis.figures.style import CYCLE, MARKERS
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.reproduce.claims import Claim, ClaimFinding, claim, digits, words
from chaincor.workflows.reproduce.curve import Curve, fit_rows, limit_at_zero
from chaincor.workflows.reproduce.drawing import IMPACT_SPEED, Axes, Figure, draw_points
from chaincor.workflows.reproduce.measurements import MeasuredPoint, Measurements, NoNumber, column
from chaincor.workflows.reproduce.plan import (
    PAPER_ORDERS,
    ReproductionPlan,
    Study,
    chains,
    harmonic_chains,
)

_KEY = "increase"
# C and the slopes of figure 6 are fitted over this range. The paper fits "at low speed" without a
# range, so we use about the decade from the slowest speed in its figures, 0.008 v*.
FIT_RANGE = (0.01, 0.1)
# Fits over the two halves of the range, and up to the fastest speed, show how the result depends on
# the range.
RANGES = (FIT_RANGE, (0.01, 0.0317), (0.0317, 0.1), (0.01, np.inf))
# The power in the limit v0 -> 0 is found from this number of slowest speeds.
_SLOWEST = 4
# Slopes that the paper prints in figure 6, by the order r of the lowest anharmonic term.
_PAPER_SLOPES = {3: "1.34", 4: "2.09", 5: "3.14"}


def study(plan: ReproductionPlan) -> Study:
    """Return the scenes of power chains of the three orders, and of the harmonic chain."""
    lengths, tolerances = (plan.curve_particles,), plan.increase_tolerances
    scenes = harmonic_chains(lengths, min(tolerances.values()))
    for order, c in PAPER_ORDERS.items():
        bond = {"power_order": order, "power_c": c}
        scenes += chains("power", lengths, plan.increase_speeds[order], tolerances[order], **bond)
    return Study(_KEY, "increase of dissipation, r = 3, 4, 5", scenes)


def increase_of(points: list[MeasuredPoint], harmonic: MeasuredPoint) -> Curve:
    """
    Return 1 - eta minus its value for the harmonic chain of equal length, against v0/v*.

    For the harmonic chain, the result of the reference engine is preferred, because it is exact.
    """
    exact = harmonic.restitution, harmonic.error
    if harmonic.reference is not None and harmonic.reference.result:
        exact = harmonic.reference.result["restitution"], harmonic.bar_of(harmonic.reference)
    values = exact[0] - column(points, "restitution")
    return Curve(points, column(points, "speed"), values, exact[1] + column(points, "error"))


def shortening_of(points: list[MeasuredPoint], harmonic: MeasuredPoint) -> Curve:
    """
    Return t_c of the harmonic chain minus t_c of the chain, against v0/v*.

    Because contact times have no error bars, the difference between the engines is their error.
    """
    both = np.array(
        [
            [point.answers[end].result["last_contact_time"] for end in (0, -1)]
            for point in (harmonic, *points)
        ]
    )
    bars, times = np.abs(both[:, 0] - both[:, 1]), both[:, 1]
    return Curve(points, column(points, "speed"), times[0] - times[1:], bars[0] + bars[1:])


def local_powers(curve: Curve) -> tuple[Array, Array]:
    """
    Return the geometric means of neighbouring speeds, and the local powers between these speeds.

    A power is nan if a value of the curve is not positive.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        powers = np.diff(np.log(curve.y)) / np.diff(np.log(curve.x))
    return np.sqrt(curve.x[1:] * curve.x[:-1]), powers


def limit_power(curve: Curve, order: int, quantity: str = "the increase") -> ClaimFinding:
    """
    Find the power of v0 with which an increase grows, in the limit v0 -> 0.

    The next term of the increase is smaller by the factor v0^(r-2), where r is the `order` of the
    lowest anharmonic term. At low speed, the local power is therefore linear in v0^(r-2), and a
    straight line through the slowest speeds gives the limit. The error is the sum of two changes of
    the limit: the change with one speed less, and the change that the error bars of eta allow.
    """
    places, powers = local_powers(curve)
    if not powers.size:
        raise NoNumber("one speed only")
    x, y = places[: _SLOWEST - 1] ** (order - 2), powers[: _SLOWEST - 1]
    limit, error = np.nan, np.nan
    if y.size == _SLOWEST - 1 and np.all(np.isfinite(y)):
        limit, change = limit_at_zero(x, y, 1)
        relative = np.abs(curve.errors / curve.y)[:2]
        error = float(change + float(np.sum(relative)) / np.log(curve.x[1] / curve.x[0]))
    return ClaimFinding(
        limit,
        error,
        f"limit v₀ → 0 of the power of {quantity} between neighbouring speeds, by the "
        f"{_SLOWEST} slowest; at {places[0]:.2g} v* it is {powers[0]:.3f}; ± change if "
        "one speed is left out, with error bars",
        curve.points[:_SLOWEST],
    )


def _both(measured: Measurements, order: int) -> tuple[list[MeasuredPoint], MeasuredPoint]:
    """Return the power chains of an order, and the harmonic chain."""
    power = measured.select(_KEY, "power", 1, power_order=order)
    return power, measured.select(_KEY, "harmonic", 1)[0]


def increases(
    measured: Measurements, study: str = _KEY, potential: str = "power", by: str = "power_order"
) -> dict[int, Curve]:
    """Return the increase of dissipation for each value that a field has in a study's scenes."""
    found = {}
    for value in sorted({getattr(p.scene, by) for p in measured.select(study, potential)}):
        points = measured.select(study, potential, **{by: value})
        harmonic = measured.select(study, "harmonic", particles=points[0].particles)
        if harmonic:
            found[value] = increase_of(points, harmonic[0])
    return found


def _contact_time(order: int) -> Claim:
    @claim(
        "before eq. (20)",
        words(order - 2.0),
        f"contact time shortens as v₀^(r−2), r = {order}",
        key=f"contact time r = {order}",
    )
    def power(measured: Measurements) -> ClaimFinding:
        shortening = shortening_of(*_both(measured, order))
        return limit_power(
            shortening,
            order,
            "the difference between t_c of the harmonic chain and t_c for U = s²/2 "
            f"+ c s^{order}, n = {shortening.points[0].particles},",
        )

    return power


def _power(order: int) -> Claim:
    @claim(
        "eq. (20)",
        words(order - 2.0),
        f"dissipation grows as v₀^(r−2), r = {order}",
        text=f"increase ∝ (v₀/v*)^(r−2), r = {order}, agrees at low speed",
        key=f"power r = {order}",
        figure=_KEY,
    )
    def power(measured: Measurements) -> ClaimFinding:
        return limit_power(increase_of(*_both(measured, order)), order)

    return power


def _printed_power(order: int) -> Claim:
    @claim(
        "figure 6",
        digits(_PAPER_SLOPES[order]),
        f"slope {_PAPER_SLOPES[order]} of figure 6",
        text=f"fitted slope {_PAPER_SLOPES[order]} for r = {order}",
        key=f"printed power r = {order}",
        correction="{value:.2f} from 0.01 to 0.1 v*",
        unsaid="over which range of speeds",
        figure=_KEY,
    )
    def slope(measured: Measurements) -> ClaimFinding:
        increase = increase_of(*_both(measured, order))
        part = increase.between(*FIT_RANGE)
        fit, *others = fits = increase.over(RANGES, Curve.power_law) or [part.power_law()]
        contacts = sorted({int(p.contacts) for p in part.points})
        kinks = (
            f" The increase has a kink at each change of the number of contacts, from "
            f"{contacts[-1]} down to {contacts[0]}, and no single power describes it"
            if len(contacts) > 1
            else ""
        )
        return ClaimFinding(
            fit.exponent,
            fit.exponent_error,
            f"fit to {fit.points} points, {fit.first:.3g} to {fit.last:.3g} v*, the range of all "
            "low-speed fits here; over its halves and at higher speeds "
            + ", ".join(f"{o.exponent:.2f} ({o.first:.2g} to {o.last:.2g} v*)" for o in others)
            + f".{kinks}",
            part.points,
            (min(f.exponent for f in fits), max(f.exponent for f in fits)) if others else None,
        )

    return slope


CLAIMS = tuple(make(r) for make in (_contact_time, _power, _printed_power) for r in PAPER_ORDERS)


def figure(measured: Measurements) -> Figure:
    """Return the figure of the increase for r = 3, 4, 5, with fitted and printed slopes."""
    found = increases(measured)
    worst = max((i.largest_relative_error for i in found.values()), default=float("nan"))
    fastest = max((float(i.x[-1]) for i in found.values()), default=float("nan"))
    constants = ", ".join(f"{c:g} (r = {order})" for order, c in PAPER_ORDERS.items())

    def draw(ax: Axes, below: Axes) -> None:
        for (order, increase), color, marker in zip(found.items(), CYCLE, MARKERS, strict=False):
            fit, slope = increase.between(*FIT_RANGE).power_law(), float(_PAPER_SLOPES[order])
            label = rf"$r={order}$: fitted {fit.exponent:.2f}, paper {slope}"
            draw_points(ax, increase, label=label, color=color, marker=marker)
            u = np.array(FIT_RANGE)
            ax.plot(u, fit.at(u), color=color, linewidth=0.9)
            centre = float(np.sqrt(u[0] * u[1]))
            ax.plot(u, fit.at(centre) * (u / centre) ** slope, "--", color=color, linewidth=0.9)
            places, local = local_powers(increase)
            below.plot(places, local, color=color, marker=marker, markersize=3.5, linewidth=0.8)
            below.axhline(order - 2, color=color, linewidth=0.7, linestyle=":")
        ax.set(xscale="log", yscale="log", ylabel=r"$\eta_{\rm harmonic}-\eta$")
        ax.legend(loc="upper left")
        below.set(ylim=(0.0, None), ylabel=r"local power", xlabel=IMPACT_SPEED)

    return Figure(
        key=_KEY,
        title="Increase of dissipation for potentials of order 3, 4 and 5",
        caption=(
            f"The paper's figure 6, n = {measured.plan.curve_particles}: 1 − η of "
            "chains with U = s²/2 + c s^r less 1 − η of the harmonic chain. Full "
            f"lines: power laws fitted from {FIT_RANGE[0]} to {FIT_RANGE[1]} v*; "
            "dashed: the paper's slopes through the same middle; the paper does "
            f"not state their range. Data extend to {fastest:g} v*. Below: the "
            "local power d ln(η_harmonic − η)/d ln v₀ from neighbouring points. It "
            "tends to r − 2 (dotted) at low speed, rises, and jumps where the "
            "number of contacts changes. A fitted slope therefore depends on its "
            f"range. c is {constants}; its sign is the paper's, which stiffens "
            "compression. Its size does not matter, because c is ±1 if strains, "
            "like v*, are in units of |c|^(−1/(r−2)). The largest error bar is "
            f"{100 * worst:.2g} % of the increase it belongs to."
        ),
        alt=(
            "Three nearly straight lines of slopes near 1, 2 and 3; below, their local powers "
            "begin at 1, 2 and 3 and leave them above 0.02 to 0.1 v*."
        ),
        draw=draw,
        records=increase_records(found, "power_order"),
        fits=fit_rows(
            "v₀/v*",
            {f"increase, r = {r}": i.over(RANGES, Curve.power_law) for r, i in found.items()},
        ),
        size=(6.4, 6.0),
        panels=(1.6, 1.0),
        sharex=True,
    )


def increase_records(found: dict[int, Curve], name: str) -> list[dict[str, Any]]:
    """Return increases as rows of data; the column `name` distinguishes them."""
    return [
        {
            name: key,
            "particles": point.particles,
            "speed": float(u),
            "increase": float(y),
            "increase_error": float(e),
            "source": point.source,
            "agrees": point.agrees,
        }
        for key, i in found.items()
        for point, u, y, e in zip(i.points, i.x, i.y, i.errors, strict=True)
    ]
