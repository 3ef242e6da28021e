"""Powers of v0: of the increase of dissipation, and of the contact time (NH section III)."""

from dataclasses import replace

import numpy as np

from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.findings.low_speed import (
    FIT_RANGE,
    PAPER_SLOPES,
    Increase,
    increase_of,
    increases,
    lj_increases,
)
from chaincor.workflows.reproduce.measurements import Measurements, Point

# The power in the limit v0 -> 0 is that of so many of the slowest speeds.
_SLOWEST = 4


def limit_power(increase: Increase, order: int) -> tuple[float, float]:
    """
    Return the power of the increase in the limit v0 -> 0, and its error.

    What comes next is smaller by v0^(r-2), so that the power between neighbouring speeds changes
    in proportion to that: a straight line through those of the slowest speeds. The error is what
    one speed less changes, and what error bars of eta allow.
    """
    if increase.speeds.size < _SLOWEST:
        return np.nan, np.nan
    places, powers = increase.local_powers()
    if not np.all(np.isfinite(powers[: _SLOWEST - 1])):
        return np.nan, np.nan
    x = places[: _SLOWEST - 1] ** (order - 2)
    limit, shorter = (
        np.polyfit(x[:count], powers[:count], 1)[1] for count in (_SLOWEST - 1, _SLOWEST - 2)
    )
    relative = np.abs(increase.errors / increase.values)[:2]
    noise = float(np.sum(relative)) / np.log(increase.speeds[1] / increase.speeds[0])
    return float(limit), float(abs(limit - shorter) + noise)


def power_findings(measured: Measurements) -> dict[str, Finding]:
    """Return what powers of the speed are found, by the key of the rule that judges it."""
    found = increases(measured)
    results = _low_speed_powers(measured)
    for order in PAPER_SLOPES:
        if order not in found:
            missing = Finding(np.nan, np.nan, "no points")
            names = ("power", "printed power", "contact time")
            results |= {f"{name} r = {order}": missing for name in names}
            continue
        increase = found[order]
        results[f"power r = {order}"] = _limit_of(increase, order)
        results[f"contact time r = {order}"] = _limit_of(
            shortening_of(increase),
            order,
            f"what t_c of U = s²/2 + c s^{order}, n = {increase.baseline.particles}, is shorter by "
            "than that of the harmonic chain,",
        )
        results[f"printed power r = {order}"] = _fitted_slope(increase)
    return results


def _low_speed_powers(measured: Measurements) -> dict[str, Finding]:
    """Return the powers of bonds whose lowest anharmonic term is the cubic one."""
    missing = Finding(np.nan, np.nan, "no points")
    baseline = measured.select("harmonic_velocities", "harmonic")
    others = {
        name: increase_of(measured.select("curves", name), baseline) for name in ("toda", "log")
    }
    powers = {name: _limit_of(i, 3) for name, i in others.items() if i is not None}
    found = lj_increases(measured)
    shortest = min(found, default=0)
    lj = _limit_of(found[shortest], 3) if found else missing
    if len(powers) < len(others):
        return {"power lj": lj, "power of other types": missing}
    farthest = max(powers.values(), key=lambda finding: abs(finding.value - 1.0))
    described = ", ".join(
        f"{name} {finding.value:.3f} ± {finding.error:.3f}" for name, finding in powers.items()
    )
    return {
        "power lj": replace(lj, text=f"n = {shortest}: {lj.text}"),
        "power of other types": replace(
            farthest, text=f"of two the one further from 1, {described}: {farthest.text}"
        ),
    }


def _limit_of(increase: Increase, order: int, quantity: str = "the increase") -> Finding:
    limit, error = limit_power(increase, order)
    places, powers = increase.local_powers()
    if not powers.size:
        return Finding(limit, error, "one speed only")
    return Finding(
        limit,
        error,
        f"limit v₀ → 0 of the power of {quantity} between neighbouring speeds, by the {_SLOWEST} "
        f"slowest; at {places[0]:.2g} v* it is {powers[0]:.3f}; ± what one speed less and error "
        "bars change",
        increase.points[:_SLOWEST],
    )


def shortening_of(increase: Increase) -> Increase:
    """Return what t_c of anharmonic chains is shorter than that of the harmonic one, in its place.

    Contact times have no bar of their own: what the two engines differ by stands for it.
    """

    def time(point: Point) -> tuple[float, float]:
        both = [
            float(answer.result["last_contact_time"])
            for answer in (point.in_house, point.lammps)
            if answer is not None and answer.result is not None
        ]
        return both[0], abs(both[0] - both[-1])

    zero, times = time(increase.baseline), [time(p) for p in increase.points]
    return replace(
        increase,
        values=zero[0] - np.array([t for t, _ in times]),
        errors=np.array([zero[1] + bar for _, bar in times]),
    )


def _fitted_slope(increase: Increase) -> Finding:
    fit, *others = fits = increase.fits() or [increase.fit(*FIT_RANGE)]
    within = increase.within(*FIT_RANGE)
    contacts = sorted({int(p.contacts) for p in within})
    kinks = (
        f" Where the number of contacts changes, from {contacts[-1]} down to {contacts[0]}, the "
        "increase has a kink, and no power is the right one"
        if len(contacts) > 1
        else ""
    )
    return Finding(
        fit.exponent,
        fit.exponent_error,
        f"fit to {fit.points} points, {fit.first:.3g} to {fit.last:.3g} v*, the range of all low-"
        "speed fits here; over its halves and carried on "
        + ", ".join(f"{o.exponent:.2f} ({o.first:.2g} to {o.last:.2g} v*)" for o in others)
        + f".{kinks}",
        within,
        (min(f.exponent for f in fits), max(f.exponent for f in fits)) if others else None,
    )
