r"""
Detailed balance: a chain that comes with the speeds of its own temperature leaves with them.

    python -m benchmarks.warm.detailed_balance [--potential toda] [--particles 10] [--samples 1000]
        [--temperature 1e-3] [--engine reference] [--tolerance 1e-3 | --timestep 0.1]
        [--workers N] [--json]

Take the surface in phase space on which the centre of mass is at a distance L from the wall,
farther than any state of weight reaches. The collision maps states that cross it inward to states
that cross it outward. Such a map keeps the flux :math:`|V|\,dP\,d\Gamma`, where :math:`\Gamma` are
the other coordinates and momenta (Liouville), and the energy :math:`M V^2/2 + H`. So it keeps the
weight

.. math:: |V| \exp(-M V^2/2T)\,dV \; \exp(-H/T)\,d\Gamma .

Incoming speeds drawn from the first factor, the flux-weighted Maxwell distribution, with the chain
in equilibrium at T, come out with the same distribution: :math:`K = M V^2/2` is exponential with
mean T. And as the motion can be reversed, (K before, K after) has a symmetric joint distribution.

This holds for the whole collision alone. The map is that to the *first* outward crossing, and L is
so large that a chain which crosses it outward can (but for a part of the states of weight 1e-12)
not touch the wall any more: so the crossing is the end, and every contact before it counts, however
late. Almost every chain does cross in the end: the states with the centre of mass nearer than L are
of finite volume at a given energy, and a flow that keeps volumes leaves a finite one again
(Poincare), but for a set of measure 0. Chains that leave slowly take long; their number falls as V,
like their flux. A program that gave up on them, or stopped at a fixed time, would find speeds too
large: in this test 'argued' and 'open' ends are counted.

Tests: Kolmogorov and Smirnov's of K/T after; the mean of K/T, whose standard error is 1/sqrt(N);
and McNemar's of the symmetry, of how many go from below T to above and back.

With `--timestep` all samples have that step, in place of a tolerance that long chains miss: see
``fixed_steps``.
"""

import argparse
import json
import math
import time
from collections import Counter
from typing import Any

import numpy as np
from scipy import stats

from benchmarks.warm.fixed_steps import Carried, carry, same_probability
from chaincor import Scene, collide_many


def thermal_speeds(temperature: float, mass: float, count: int, seed: int) -> np.ndarray:
    """Draw speeds with the density V exp(-M V^2/2T)."""
    uniform = np.random.default_rng(seed).random(count)
    return np.sqrt(-2.0 * temperature / mass * np.log1p(-uniform))


def measure(
    scene: Scene, samples: int, workers: int | None = None, timestep: float | None = None
) -> dict[str, Any]:
    """Return the results of many collisions and of the tests."""
    assert scene.temperature is not None
    particles, temperature = scene.particles, scene.temperature
    speeds = thermal_speeds(temperature, particles, samples, seed=20041120)
    # Slower ones, of which there are 5e-4, would take most of the time, and to change them changes
    # less than can be seen of so many.
    speeds = np.maximum(speeds, 0.03 * math.sqrt(temperature / particles))
    started, cpu = time.perf_counter(), time.process_time()
    if timestep is None:
        carried, printed = _met(scene, speeds, workers)
    else:
        carried, printed = carry(scene, samples, timestep, speeds), {"timestep": timestep}
    sound = np.isfinite(carried.e)
    before = 0.5 * particles * speeds[sound] ** 2 / temperature
    after = before * carried.e[sound] ** 2
    up = int(np.count_nonzero((before < 1.0) & (after > 1.0)))
    down = int(np.count_nonzero((before > 1.0) & (after < 1.0)))
    count = len(after)
    return {
        "potential": scene.label,
        "particles": particles,
        "temperature": temperature,
        "engine": scene.engine,
        "samples": samples,
        "failed": samples - count,
        **printed,
        "ends": dict(Counter(carried.endings)),
        "mean_contacts": float(np.mean(carried.contacts[sound])),
        "p_before": float(stats.kstest(before, "expon").pvalue),
        "p_after": float(stats.kstest(after, "expon").pvalue),
        "mean": float(np.mean(after)),
        "z": float((np.mean(after) - 1.0) * math.sqrt(count)),
        "p_mean": float(2.0 * stats.norm.sf(abs(np.mean(after) - 1.0) * math.sqrt(count))),
        # Average change by the collision, over the same samples.
        "z_change": float(
            np.mean(after - before) / (np.std(after - before, ddof=1) / math.sqrt(count))
        ),
        "up": up,
        "down": down,
        "p_symmetry": same_probability(up, down),
        "correlation": float(np.corrcoef(before, after)[0, 1]),
        "seconds": time.perf_counter() - started,
        "processor_seconds": time.process_time() - cpu,
    }


def _met(scene: Scene, speeds: np.ndarray, workers: int | None) -> tuple[Carried, dict[str, Any]]:
    """Carry out collisions to the scene's tolerance, and return their errors too."""
    found = collide_many(scene, len(speeds), velocities=speeds, workers=workers, progress=True)
    etas = [np.nan if s.restitution is None else s.restitution for s in found.samples]
    bars = [s.restitution_error or np.nan for s in found.samples]
    energies = 0.5 * scene.particles * speeds**2 / (scene.temperature or np.nan)
    carried = Carried(
        np.sqrt(etas),
        np.array([s.contacts or 0 for s in found.samples]),
        [str(s.ending) for s in found.samples],
    )
    # The error is that of energies after.
    error = float(np.nanmean(energies * bars))
    return carried, {"inexact": len(found.inexact), "numerical_error": error}


def main() -> None:
    """Measure one chain and print it."""
    parser = argparse.ArgumentParser(description="detailed balance of warm chains")
    parser.add_argument("--potential", default="toda")
    parser.add_argument("--particles", type=int, default=10)
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--temperature", type=float, default=1e-3)
    parser.add_argument("--engine", default="reference")
    parser.add_argument("--tolerance", type=float, default=1e-3)
    parser.add_argument("--timestep", type=float)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    scene = Scene(
        potential=given.potential,
        particles=given.particles,
        velocity=0.1,
        temperature=given.temperature,
        engine=given.engine,
        tolerance=given.tolerance,
    )
    found = measure(scene, given.samples, given.workers, given.timestep)
    if given.json:
        print(json.dumps(found))
        return
    for name, value in found.items():
        print(f"{name:18} {value:.6g}" if isinstance(value, float) else f"{name:18} {value}")


if __name__ == "__main__":
    main()
