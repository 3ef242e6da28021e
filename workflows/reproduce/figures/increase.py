"""The increase of dissipation with speed for bonds of order 3, 4 and 5 (NH figure 6, eq. 20)."""

from contextlib import suppress
from typing import Any

import numpy as np

from chaincor.analysis.figures.style import CYCLE, MARKERS
from chaincor.workflows.reproduce.claims import Claim, Finding, claim, digits, words
from chaincor.workflows.reproduce.drawing import IMPACT_SPEED, Axes, Figure, draw_points
from chaincor.workflows.reproduce.fits import FIT_RANGE, Increase, fit_rows, increase_of
from chaincor.workflows.reproduce.measurements import Measurements, NoNumber
from chaincor.workflows.reproduce.plan import PAPER_ORDERS, Plan, Study, chains, harmonic_chains

_KEY = "increase"
# The slopes that the paper prints in figure 6, by the order r of the lowest anharmonic term.
_PAPER_SLOPES = {3: "1.34", 4: "2.09", 5: "3.14"}


def study(plan: Plan) -> Study:
    """Return power chains of the three orders, and the harmonic one."""
    lengths, tolerances = (plan.curve_particles,), plan.increase_tolerances
    scenes = harmonic_chains(lengths, min(tolerances.values()))
    for order, c in PAPER_ORDERS.items():
        bond = {"power_order": order, "power_c": c}
        scenes += chains("power", lengths, plan.increase_speeds[order], tolerances[order], **bond)
    return Study(_KEY, "increase of dissipation, r = 3, 4, 5", scenes)


def _increase(measured: Measurements, order: int) -> Increase:
    chains = measured.select(_KEY, "power", power_order=order)
    return increase_of(chains, measured.select(_KEY, "harmonic"))


def increases(measured: Measurements) -> dict[int, Increase]:
    """Return the increase for each order r that has points."""
    found = {}
    for order in PAPER_ORDERS:
        with suppress(NoNumber):
            found[order] = _increase(measured, order)
    return found


def _contact_time(order: int) -> Claim:
    @claim(
        "before eq. (20)",
        words(order - 2.0),
        f"contact time shortens as v₀^(r−2), r = {order}",
        key=f"contact time r = {order}",
    )
    def power(measured: Measurements) -> Finding:
        increase = _increase(measured, order)
        return increase.of_contact_times().limit_finding(
            order,
            f"what t_c of U = s²/2 + c s^{order}, n = {increase.baseline.particles}, is shorter by "
            "than that of the harmonic chain,",
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
    def power(measured: Measurements) -> Finding:
        return _increase(measured, order).limit_finding(order)

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
    def slope(measured: Measurements) -> Finding:
        increase = _increase(measured, order)
        fit, *others = fits = increase.fits() or [increase.fit(*FIT_RANGE)]
        within = increase.within(*FIT_RANGE)
        contacts = sorted({int(p.contacts) for p in within})
        kinks = (
            f" Where the number of contacts changes, from {contacts[-1]} down to {contacts[0]}, "
            "the increase has a kink, and no power is the right one"
            if len(contacts) > 1
            else ""
        )
        return Finding(
            fit.exponent,
            fit.exponent_error,
            f"fit to {fit.points} points, {fit.first:.3g} to {fit.last:.3g} v*, the range of all "
            "low-speed fits here; over its halves and carried on "
            + ", ".join(f"{o.exponent:.2f} ({o.first:.2g} to {o.last:.2g} v*)" for o in others)
            + f".{kinks}",
            within,
            (min(f.exponent for f in fits), max(f.exponent for f in fits)) if others else None,
        )

    return slope


CLAIMS = tuple(make(r) for make in (_contact_time, _power, _printed_power) for r in PAPER_ORDERS)


def figure(measured: Measurements) -> Figure:
    """Return the increase of dissipation for r = 3, 4, 5, with fitted and printed slopes."""
    found = increases(measured)
    worst = max((i.largest_relative_error for i in found.values()), default=float("nan"))
    fastest = max((float(i.speeds[-1]) for i in found.values()), default=float("nan"))
    constants = ", ".join(f"{c:g} (r = {order})" for order, c in PAPER_ORDERS.items())

    def draw(ax: Axes, below: Axes) -> None:
        for (order, increase), color, marker in zip(found.items(), CYCLE, MARKERS, strict=False):
            fit, slope = increase.fit(*FIT_RANGE), float(_PAPER_SLOPES[order])
            label = rf"$r={order}$: fitted {fit.exponent:.2f}, paper {slope}"
            looks: dict[str, Any] = {"color": color, "marker": marker, "label": label}
            draw_points(
                ax, increase.points, "speed", increase.values, errors=increase.errors, **looks
            )
            u = np.array(FIT_RANGE)
            ax.plot(u, fit.at(u), color=color, linewidth=0.9)
            centre = float(np.sqrt(u[0] * u[1]))
            ax.plot(u, fit.at(centre) * (u / centre) ** slope, "--", color=color, linewidth=0.9)
            places, local = increase.local_powers()
            below.plot(places, local, color=color, marker=marker, markersize=3.5, linewidth=0.8)
            below.axhline(order - 2, color=color, linewidth=0.7, linestyle=":")
        ax.set(xscale="log", yscale="log", ylabel=r"$\eta_{\rm harmonic}-\eta$")
        ax.legend(loc="upper left")
        below.set(ylim=(0.0, None), ylabel=r"local power", xlabel=IMPACT_SPEED)

    return Figure(
        key=_KEY,
        title="Increase of dissipation for potentials of order 3, 4 and 5",
        caption=(
            f"The paper's figure 6, n = {measured.plan.curve_particles}: 1 − η of chains with U = "
            "s²/2 + c s^r less that of the harmonic chain. Full lines: power laws fitted from "
            f"{FIT_RANGE[0]} to {FIT_RANGE[1]} v*; dashed: the paper's slopes, whose range it does "
            f"not say, through the same middle. Data go on to {fastest:g} v*. Below, the local "
            "power d ln(η_harmonic − η)/d ln v₀, from neighbouring points: it tends to r − 2 "
            "(dotted) at low speed, rises, and jumps where the number of contacts changes, so that "
            f"a fitted slope depends on its range. c is {constants}; its sign is the paper's, "
            "which stiffens compression, and its size does not matter: with strains in units of "
            f"|c|^(−1/(r−2)), as v* is, c is ±1. The largest error bar is {100 * worst:.2g} % of "
            "the increase it belongs to."
        ),
        alt=(
            "Three nearly straight lines of slopes near 1, 2 and 3; below, their local powers "
            "begin at 1, 2 and 3 and leave them above 0.02 to 0.1 v*."
        ),
        draw=draw,
        records=increase_records(found, "power_order"),
        fits=fit_rows("v₀/v*", {f"increase, r = {r}": i.fits() for r, i in found.items()}),
        size=(6.4, 6.0),
        panels=(1.6, 1.0),
        sharex=True,
    )


def increase_records(found: dict[int, Increase], name: str) -> list[dict[str, Any]]:
    """Return increases as rows; `name` is what they are told apart by."""
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
        for point, u, y, e in zip(i.points, i.speeds, i.values, i.errors, strict=True)
    ]
