r"""
Test detailed balance: a chain with thermal speeds leaves the wall with thermal speeds.

    python -m benchmarks.warm.detailed_balance [--potential toda] [--particles 10] [--samples 1000]
        [--temperature 1e-3] [--engine reference] [--tolerance 1e-3 | --timestep 0.1]
        [--workers N] [--json]

Consider the surface in phase space on which the centre of mass is at a distance L from the wall,
where L is larger than in any state of relevant weight. The collision maps states that cross this
surface inward to states that cross it outward. The map preserves the flux
:math:`|V|\,dP\,d\Gamma`, where :math:`\Gamma` are the other coordinates and momenta (Liouville),
and the energy :math:`M V^2/2 + H`. It therefore preserves the weight

.. math:: |V| \exp(-M V^2/2T)\,dV \; \exp(-H/T)\,d\Gamma .

Let incoming speeds have the first factor as their distribution, which is the flux-weighted Maxwell
distribution, and let the chain be in equilibrium at T. Outgoing speeds then have the same
distribution: :math:`K = M V^2/2` is exponential with mean T. Because the motion is reversible, the
joint distribution of (K before, K after) is symmetric.

This holds only for whole collisions. The map ends at the *first* outward crossing. L is so large
that a chain can touch the wall after this crossing only in states of weight 1e-12. The crossing is
therefore the end of the collision, which includes all earlier contacts, however late. Almost every
chain crosses: at a given energy, states with the centre of mass closer than L have a finite volume,
and a flow that preserves volume leaves a finite volume again (Poincare), except for a set of
measure 0. Chains that leave slowly take long. Their number is proportional to V, like their flux. A
program that stopped such collisions at a fixed time would find speeds that are too large. This test
therefore counts the endings 'argued' and 'open'.

Three tests are made: the Kolmogorov-Smirnov test of K/T after the collision; the mean of K/T, whose
standard error is 1/sqrt(N); and for the symmetry McNemar's test, which compares how many collisions
raise K above T and how many lower it below T.

With `--timestep` all samples have this time step instead of a tolerance, which long chains miss:
see ``fixed_steps``.
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
    """Simulate many collisions; return their results and those of the tests."""
    assert scene.temperature is not None
    particles, temperature = scene.particles, scene.temperature
    speeds = thermal_speeds(temperature, particles, samples, seed=20041120)
    # A fraction of 5e-4 is slower and would take most of the time. Making it faster changes less
    # than the statistical error.
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
        # Mean change in the collision, in standard errors.
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
    """Simulate collisions to the scene's tolerance; also return their errors."""
    found = collide_many(scene, len(speeds), velocities=speeds, workers=workers, progress=True)
    etas = [np.nan if s.restitution is None else s.restitution for s in found.samples]
    bars = [s.restitution_error or np.nan for s in found.samples]
    energies = 0.5 * scene.particles * speeds**2 / (scene.temperature or np.nan)
    carried = Carried(
        np.sqrt(etas),
        np.array([s.contacts or 0 for s in found.samples]),
        [str(s.ending) for s in found.samples],
    )
    # Error of the energies after the collision.
    error = float(np.nanmean(energies * bars))
    return carried, {"inexact": len(found.inexact), "numerical_error": error}


def main() -> None:
    """Simulate one chain, and print the results."""
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
