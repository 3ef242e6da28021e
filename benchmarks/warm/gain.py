r"""
Measure how often warm chains gain speed in a collision, and test bounds of the second law.

    python -m benchmarks.warm.gain [--samples 1000] [--temperature 1e-3] [--potential log]
        [--timestep 0.2] [--only figure|bounds] [-o docs/images]

Figure and table ``warm_gain`` show mean e and P(e > 1) against the impact speed in units of the
thermal speed of a particle, :math:`\sqrt{T/m}`, for n = 10, 50 and 100. All samples have the same
time step, because a distribution does not require accurate single results: see ``fixed_steps``. The
samples use a quarter of the given time step. The same seeds are also run with the whole and half of
the time step. McNemar's test then compares how many samples rise above 1 with the larger time step
and how many fall below.

Table ``warm_bounds`` tests a bound of Tasaki (cond-mat/0408481) on the gain of a body in
equilibrium at a wall: the momentum after the collision exceeds the momentum before by at most
:math:`O(\sqrt{M T})`. The collision maps the flux :math:`|V|\,dP\,d\Gamma = dK\,d\Gamma`, with
:math:`K = M V^2/2`, onto itself and preserves :math:`K + H` (see ``detailed_balance``). For the
energies K alone, it is therefore a stochastic map that preserves :math:`\pi(K) = e^{-K/T}/T`. Let
p be the density of K before the collision and q the density after. Then
:math:`\sup q/\pi \le \sup p/\pi`. If K is uniform in a window of width T above :math:`K_0`, this
gives for every :math:`\Delta > 0`

.. math:: P(K' \ge K_0 + T + \Delta) \le e^{-\Delta/T}.

Because :math:`P' \ge P + x\sqrt{2MT}` implies :math:`K' \ge K + x^2 T`, the momentum exceeds that
before by :math:`x \sqrt{2 M T}` with a probability of at most :math:`e^{1 - x^2}`, which is
Tasaki's statement. (For a sharp impact speed there is no such bound, because sup p is infinite.)
Relative entropy to :math:`\pi` never increases. With the entropies S of p and q,
:math:`\langle K' \rangle - \langle K \rangle \le T (S_q - S_p)`. Here :math:`S_p = \ln T`, and a
mean bounds an entropy, :math:`S_q \le 1 + \ln \langle K' \rangle`. Therefore

.. math:: \langle K' \rangle - T \ln(\langle K' \rangle/T) \le \langle K \rangle + T.
"""

import argparse
import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from benchmarks.warm.fixed_steps import carry, same_probability
from chaincor import Scene, collide
from chaincor.analysis.distribution import Distribution, share_above
from chaincor.analysis.figures.style import BLUE, GREEN, VERMILION, new_figure

RATIOS = (0.15, 0.3, 0.5, 0.75, 1.0, 1.5, 2.5, 5.0, 10.0)
PARTICLES = (10, 50, 100)
# Fractions of the given time step. The first is used for the results.
FINER = (0.25, 0.5, 1.0)
# Lower ends of windows of impact energies, and energy gains, both in units of T.
WINDOWS = (0.0, 1.0, 4.0, 16.0)
GAINS = (0.25, 0.5, 1.0, 2.0, 3.0)
_COLOURS = (BLUE, VERMILION, GREEN)
# A bound is violated if the p-value of the number of samples beyond it is below this.
LEAST_P = 1e-3
_SEED = 408481


def measure_gain(scene: Scene, samples: int, step: float) -> dict[str, Any]:
    """Return mean e and P(e > 1) at one impact speed, and their changes with the time step."""
    assert scene.temperature is not None
    runs = [carry(scene, samples, part * step) for part in FINER]
    sound = np.logical_and.reduce([np.isfinite(run.e) for run in runs])
    finest, *coarser = (run.e[sound] for run in runs)
    none = np.zeros(len(finest))
    mean, above = Distribution.of(finest, none), share_above(finest, none, 1.0)
    row = {
        "potential": scene.label,
        "particles": scene.particles,
        "temperature": scene.temperature,
        "velocity": scene.impact_velocity,
        "over_thermal": scene.impact_velocity / math.sqrt(scene.temperature),
        "timestep": FINER[0] * step,
        "samples": len(finest),
        "unsettled": samples - len(finest),
        "mean_e": mean.mean,
        "standard_error": mean.standard_error,
        "p_above_one": above.value,
        "low": above.low,
        "high": above.high,
        "mean_contacts": float(np.mean(runs[0].contacts)),
        "cold_e": collide(scene.without("temperature")).kinematic_restitution,
    }
    for part, e in zip(FINER[1:], coarser, strict=True):
        up = int(np.count_nonzero((e > 1.0) & (finest <= 1.0)))
        down = int(np.count_nonzero((e <= 1.0) & (finest > 1.0)))
        times = f"{part / FINER[0]:g}"
        row |= {
            f"mean_e_{times}": float(np.mean(e)),
            f"p_above_one_{times}": float(np.mean(e > 1.0)),
            f"up_{times}": up,
            f"down_{times}": down,
            f"p_same_{times}": same_probability(up, down),
            # Fraction of samples whose e is different with this time step.
            f"moved_{times}": float(np.mean(np.abs(e - finest) > 1e-3)),
        }
    return row


def measure_bounds(scene: Scene, window: float, samples: int, step: float) -> dict[str, Any]:
    """Return how close chains with impact energies in a window come to the bounds."""
    assert scene.temperature is not None
    temperature, mass = scene.temperature, float(scene.particles)
    before = window + np.random.default_rng(_SEED).random(samples)
    # In the lowest window, a fraction of 1e-4 of the samples is slower. Their exact energy does not
    # matter.
    before = np.maximum(before, 1e-4)
    speeds = np.sqrt(2.0 * temperature * before / mass)
    e = carry(scene, samples, step, speeds).e
    sound = np.isfinite(e)
    before = before[sound]
    after = before * e[sound] ** 2
    count, mean = len(after), float(np.mean(after))
    row = {
        "potential": scene.label,
        "particles": scene.particles,
        "temperature": temperature,
        "window": window,
        "samples": count,
        "mean_before": float(np.mean(before)),
        "mean_after": mean,
        "standard_error": float(np.std(after, ddof=1)) / math.sqrt(count),
        "entropy_margin": float(np.mean(before)) + 1.0 - (mean - math.log(mean)),
    }
    for gain in GAINS:
        hits = int(np.count_nonzero(after >= window + 1.0 + gain))
        test = stats.binomtest(hits, count, math.exp(-gain), alternative="greater")
        row |= {f"share_{gain:g}": hits / count, f"p_{gain:g}": float(test.pvalue)}
    # Tasaki's form of the bound, for the momentum.
    gained = (np.sqrt(after) - np.sqrt(before)) ** 2 * (after > before)
    worst = max(float(np.mean(gained >= x * x)) / math.exp(1.0 - x * x) for x in (1.0, 1.25, 1.5))
    return row | {"momentum_share_of_bound": worst}


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    """Plot mean e and P(e > 1) against the impact speed."""
    figure, (above, below) = new_figure(2, 1, sharex=True, figsize=(5.2, 6.0))
    for particles, colour in zip(PARTICLES, _COLOURS, strict=True):
        mine = [row for row in rows if row["particles"] == particles]
        x = np.array([row["over_thermal"] for row in mine])
        e, error = (np.array([row[key] for row in mine]) for key in ("mean_e", "standard_error"))
        style = {"color": colour, "marker": "o", "ms": 3.0, "lw": 1.0, "capsize": 2.0}
        above.errorbar(x, e, yerr=error, label=f"n = {particles}", **style)
        above.plot(x, [row["cold_e"] for row in mine], color=colour, lw=0.8, ls=":")
        p, low, high = (
            np.array([row[key] for row in mine]) for key in ("p_above_one", "low", "high")
        )
        below.errorbar(x, p, yerr=(p - low, high - p), **style)
    above.axhline(1.0, color="0.5", lw=0.8)
    for ax in (above, below):
        ax.axvline(1.0, color="0.5", lw=0.8, ls="--")
        ax.set_xscale("log")
    above.set_ylabel(r"mean $e$ (dotted: cold chain)")
    below.set_ylabel(r"$P(e > 1)$")
    below.set_ylim(bottom=0.0)
    below.set_xlabel(r"impact speed over the thermal speed of a particle, $v_0/\sqrt{T/m}$")
    above.legend()
    settings = {key: rows[0][key] for key in ("potential", "temperature")}
    settings["samples"] = rows[0]["samples"]
    figure.savefig(path, metadata={"Description": json.dumps(settings)})


def write_table(rows: list[dict[str, Any]], path: Path) -> None:
    """Write a table with all digits."""
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def broken(row: dict[str, Any]) -> list[str]:
    """Return the bounds that a row of the table violates."""
    names = [f"gain of {gain:g} T" for gain in GAINS if row[f"p_{gain:g}"] < LEAST_P]
    if row["entropy_margin"] < -4.0 * row["standard_error"]:
        names.append("entropy")
    if row["momentum_share_of_bound"] > 1.0:
        names.append("momentum")
    return names


def main() -> None:
    """Compute, write and plot; fail if a bound is violated."""
    parser = argparse.ArgumentParser(description="gains of warm chains")
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--temperature", type=float, default=1e-3)
    parser.add_argument("--potential", default="log")
    parser.add_argument("--timestep", type=float, default=0.2)
    parser.add_argument("--only", choices=("figure", "bounds"))
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/images"))
    given = parser.parse_args()
    thermal = math.sqrt(given.temperature)
    gains, bounds = [], []
    for particles in PARTICLES:
        scene = Scene(
            potential=given.potential,
            particles=particles,
            velocity=thermal,
            temperature=given.temperature,
            engine="reference",
        )
        for ratio in RATIOS if given.only != "bounds" else ():
            warm = scene.replace(velocity=ratio * thermal)
            gains.append(measure_gain(warm, given.samples, given.timestep))
            print(json.dumps(gains[-1]), flush=True)
        for window in WINDOWS if given.only != "figure" else ():
            bounds.append(measure_bounds(scene, window, given.samples, 0.5 * given.timestep))
            print(json.dumps(bounds[-1]), flush=True)
    if gains:
        write_table(gains, given.output / "warm_gain.csv")
        draw(gains, given.output / "warm_gain.png")
    if bounds:
        write_table(bounds, given.output / "warm_bounds.csv")
    wrong = [f"n = {row['particles']}, K0 = {row['window']} T: {name}" for row in bounds
             for name in broken(row)]  # fmt: skip
    if wrong:
        raise SystemExit("bounds broken:\n  " + "\n  ".join(wrong))


if __name__ == "__main__":
    main()
