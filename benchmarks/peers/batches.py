"""
Compare heyoka's batch mode with the reference engine, for eight collisions.

    python -m benchmarks.peers.batches

Lennard-Jones chains of 100 particles at eight speeds are integrated to their last contacts, with
eta within 1e-11. Both programs are given the times of the last contacts. heyoka integrates all
eight chains in the lanes of a vector, and the reference engine one after the other. Both use the
coarsest setting that is accurate enough for all eight chains. Times are the shortest processor
times of several rounds, without compiling.
"""

import argparse

import numpy as np

from benchmarks.peers.integrators import coarsest, lj_powers, start_state, timed
from benchmarks.peers.reference_engine import (
    ERROR,
    restitution,
    run_ours,
    seconds_to_last_contact,
)
from chaincor.lammps_inputs.scene import Scene

SPEEDS = (0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45)
PARTICLES = 100
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(18, 28))
STEPS = tuple(0.8 / 2 ** (k / 4) for k in range(10))
TURNS = 5


class HeyokaBatch:
    """heyoka's adaptive Taylor integrator for several scenes, with a terminal event at the wall."""

    def __init__(self, scenes: list[Scene], tolerance: float) -> None:
        import heyoka as hy

        n = scenes[0].particles
        u = hy.make_vars(*(f"u{i}" for i in range(n)))
        v = hy.make_vars(*(f"v{i}" for i in range(n)))
        force = [lj_powers(u[i + 1] - u[i]) for i in range(n - 1)]
        zero = hy.expression(0.0)
        push = [(force[i - 1] if i else zero) - (force[i] if i < n - 1 else zero) for i in range(n)]

        def reflect(integrator, _direction, lane):
            integrator.state[n, lane] = abs(integrator.state[n, lane])
            return True

        wall = hy.t_event_batch(u[0], callback=reflect, direction=hy.event_direction.negative)
        self._start = np.array([start_state(scene) for scene in scenes]).T
        equations = [*zip(u, v, strict=True), *zip(v, push, strict=True)]
        self._integrator = hy.taylor_adaptive_batch(
            equations, self._start, t_events=[wall], tol=tolerance, compact_mode=True
        )

    def run(self, ends: list[float]) -> np.ndarray:
        """Return the states at the end times, one per column."""
        self._integrator.set_time(0.0)
        self._integrator.state[:] = self._start
        self._integrator.reset_cooldowns()
        self._integrator.propagate_until(ends)
        return self._integrator.state.copy()


def main() -> None:
    """Print both times and their ratio."""
    argparse.ArgumentParser(description=__doc__.splitlines()[1]).parse_args()
    scenes = [Scene(potential="lj", particles=PARTICLES, speed=speed) for speed in SPEEDS]
    tight = [run_ours(scene, 0.0125) for scene in scenes]
    exact = [restitution(run.velocities, scene) for run, scene in zip(tight, scenes, strict=True)]
    ends = [float(run.contact_times[-1]) + 1e-3 for run in tight]

    def our_error(step: float) -> float:
        found = (run_ours(scene, step, "extrapolated14").velocities for scene in scenes)
        etas = [restitution(each, scene) for each, scene in zip(found, scenes, strict=True)]
        return float(np.max(np.abs(np.array(etas) - exact)))

    def batch_error(tolerance: float) -> float:
        state = HeyokaBatch(scenes, tolerance).run(ends)
        etas = [restitution(state[PARTICLES:, k], scene) for k, scene in enumerate(scenes)]
        return float(np.max(np.abs(np.array(etas) - exact)))

    step, error = coarsest(STEPS, our_error, ERROR)
    print(f"ours: extrapolated14, H {step:.3g}, error {error:.1e}", flush=True)
    tolerance, error = coarsest(TOLERANCES, batch_error, ERROR)
    print(f"heyoka in batches: tolerance {tolerance:.1e}, error {error:.1e}", flush=True)
    batch = HeyokaBatch(scenes, tolerance)
    ours, peers = [], []
    for _ in range(TURNS):
        ours.append(
            sum(
                seconds_to_last_contact(scene, step, "extrapolated14", end)
                for scene, end in zip(scenes, ends, strict=True)
            )
        )
        peers.append(timed(lambda: batch.run(ends)))
    print(f"eight collisions: ours {1e3 * min(ours):.3g} ms, heyoka {1e3 * min(peers):.3g} ms")
    print(f"heyoka in batches over ours: {min(peers) / min(ours):.3g}")


if __name__ == "__main__":
    main()
