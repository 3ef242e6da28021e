"""An ensemble for people: numbers with both their errors, and a histogram in characters."""

import math
from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.distribution import Distribution, Quantile
from chaincor.analysis.figures.terminal import draw_histogram
from chaincor.analysis.showing.numbers import impact_speed, named_lines
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.given_bodies import chain_masses

if TYPE_CHECKING:
    from chaincor.workflows.campaign.ensemble import Ensemble

DEFAULT_PRECISION = 0.01


def describe_ensemble(result: "Ensemble", scene: Scene, precision: float) -> str:
    """Describe the samples of a warm scene; `precision` is wanted of the mean of eta."""
    eta, e, above = result.eta, result.e, result.above_one
    seeds = [sample.seed for sample in result.samples]
    assert scene.temperature is not None
    thermal = math.sqrt(scene.temperature / float(np.mean(chain_masses(scene))))
    speed = impact_speed(scene.impact_velocity, scene.bond.natural_speed)
    contacts = result.contacts
    lines = [
        f"{len(seeds)} collisions: {scene.particles} particles, {scene.label} bonds, {speed}",
        f"warm at first: T = {scene.temperature:.6g}, seeds {seeds[0]} to {seeds[-1]}; v0 is "
        f"{scene.impact_velocity / thermal:.4g} times the thermal speed of a particle",
        "",
        f"{'':22} {'eta = K_r/K_i':<32}e = sqrt(eta)",
        *(f"{name:22} {one:<32}{other}" for name, one, other in rows_of(eta, e)),
    ]
    share = f"{above.value:.4g}, {above.low:.4g} to {above.high:.4g} with 95 % confidence"
    if above.doubtful:
        share += f"; for {above.doubtful} the error bar leaves e > 1 open"
    endings = [sample.ending for sample in result.samples]
    ends = ", ".join(
        f"{endings.count(kind)} {kind}" for kind in ("proved", "argued", "open") if kind in endings
    )
    hits = f"{np.mean(contacts):.4g} on average, {contacts.min()} to {contacts.max()}"
    rows = {"P(e > 1)": share, "contacts": hits, "ends": ends}
    rows["precision"] = _precision(eta, precision)
    lines += [
        *named_lines(rows.items()),
        "",
        draw_histogram(result.kinematic_restitution, label="e", mark=1.0),
        "",
        f"run by {scene.engine}: {_schemes(result)}",
        f"time {result.seconds_total:.3g} s, "
        f"{len(seeds) / result.seconds_total:.3g} collisions a second",
    ]
    return "\n".join(lines)


def rows_of(eta: Distribution, e: Distribution) -> list[tuple[str, str, str]]:
    """Return what is told of both ratios, line by line: its name, that of eta, that of e."""
    each = [
        ("mean", _mean),
        ("numerical error", _bar),
        ("standard deviation", lambda found: _number(found.deviation)),
    ]
    rows = [(name, told(eta), told(e)) for name, told in each]
    for one, other in zip(eta.quantiles, e.quantiles, strict=True):
        name = f"quantile {100.0 * one.probability:g} %"
        rows.append((name, _interval(one), _interval(other)))
    return rows


def _mean(found: Distribution) -> str:
    if math.isnan(found.standard_error):
        return f"{found.mean:.6g}"
    return f"{found.mean:.{_digits(found.standard_error)}f} +- {found.standard_error:.1e}"


def _digits(error: float) -> int:
    return min(max(1, 2 - math.floor(math.log10(error))), 15) if error > 0.0 else 15


def _bar(found: Distribution) -> str:
    return "none asked for" if math.isnan(found.numerical_error) else f"{found.numerical_error:.1e}"


def _number(value: float) -> str:
    return "unknown" if math.isnan(value) else f"{value:.4g}"


def _interval(found: Quantile) -> str:
    value, low, high = found.value, found.low, found.high
    between = f"{low:.4g} to {high:.4g}" if math.isfinite(low + high) else "too few samples"
    return f"{value:.4g} ({between})"


def _precision(eta: Distribution, precision: float) -> str:
    needed = eta.samples_needed(precision)
    if needed is None:
        return "one sample does not tell how many are needed"
    if needed <= eta.count:
        return f"mean of eta to {precision:g}: reached with {needed} of these samples"
    return f"mean of eta to {precision:g} needs about {needed - eta.count} more samples"


def _schemes(result: "Ensemble") -> str:
    schemes = [sample.scheme for sample in result.samples if sample.scheme is not None]
    return ", ".join(f"{schemes.count(name)} {name}" for name in sorted(set(schemes)))
