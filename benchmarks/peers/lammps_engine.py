"""Print the time of LAMMPS for eta to 1e-10, and ratios to heyoka and SciPy's DOP853.

All programs integrate a Lennard-Jones chain of 100 particles at 0.4 v*. Each uses the coarsest
setting after which all finer settings are accurate enough. LAMMPS, with composed and with
extrapolated steps, finds the last contact and shows that no contact follows. Its peers are timed in
three tasks. In *last* they are given the time of the last contact, and stop slightly later. In
*look* they continue with a loose tolerance to the time at which LAMMPS's argument for the end
holds, because LAMMPS looks ahead in the same way. In *end* they continue to this time with
unchanged tolerance. Times are processor times without compiling and set-up.

Run: python -m benchmarks.peers.lammps_engine
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.peers.integrators import Dop853Chain, HeyokaChain, coarsest, timed
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.tradeoff.reference_solution import find_reference

ERROR = 1e-10
LIMIT = 5.0  # our faster time divided by heyoka's, both with a look ahead
OURS = {
    "lammps": ("order8", (0.2, 0.17, 0.15, 0.14, 0.12, 0.1, 0.085, 0.07)),
    "lammps_extrapolated": ("extrapolated12", (0.6, 0.5, 0.43, 0.37, 0.32, 0.28, 0.24)),
}
PEERS = {"heyoka": HeyokaChain, "dop853": Dop853Chain}
MORE = 4
TOLERANCES = (1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13)
LOOSE = 1e-3


def lammps_seconds(scene: Scene, numerics: Numerics) -> float:
    """Return the time of an integration, from additional runs after one set-up."""
    one = timed(lambda: lammps.run_at_steps(scene.problem, numerics, [numerics.timestep]))
    more = timed(
        lambda: lammps.run_at_steps(scene.problem, numerics, [numerics.timestep] * (1 + MORE))
    )
    return (more - one) / MORE


def compare(repeats: int = 7) -> dict[str, float]:
    """Return settings, errors, times and ratios."""
    scene = Scene(potential="lj", particles=100, speed=0.4)
    reference_value = find_reference(scene)
    last, end = reference_value.last_contact_time + 1e-3, reference_value.scouting.outcome.duration
    bond_range = reference_value.scouting.table_range()

    found: dict[str, float] = {}
    tasks: dict[str, Callable[[], float]] = {}
    for name, (scheme, steps) in OURS.items():
        bare = Numerics(scheme=scheme, bond_range=bond_range)

        def error_at(step: float, bare: Numerics = bare) -> float:
            outcome = lammps.run(scene.problem, replace(bare, timestep=step))
            return abs(outcome.eta - reference_value.restitution)

        step, found[f"{name}_error"] = coarsest(steps, error_at, ERROR)
        found[f"{name}_step"] = step
        tasks[name] = partial(lammps_seconds, scene, replace(bare, timestep=step))
    for name, kind in PEERS.items():
        chains = {tolerance: kind(scene, tolerance) for tolerance in TOLERANCES}

        def error_of(tolerance: float, chains=chains) -> float:
            chain = chains[tolerance]
            velocities = chain.run(chain.start, 0.0, last)[scene.particles :]
            eta = (velocities.mean() / scene.impact_velocity) ** 2
            return abs(float(eta) - reference_value.restitution)

        tolerance, found[f"{name}_error"] = coarsest(TOLERANCES, error_of, ERROR)
        found[f"{name}_tolerance"] = tolerance
        chosen, loose = chains[tolerance], kind(scene, LOOSE)

        def to(until: float, chosen=chosen) -> np.ndarray:
            return chosen.run(chosen.start, 0.0, until)

        tasks[f"{name}_last"] = partial(timed, partial(to, last))
        tasks[f"{name}_end"] = partial(timed, partial(to, end))
        tasks[f"{name}_look"] = partial(
            timed, lambda to=to, loose=loose: loose.run(to(last), last, end)
        )
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(repeats):
        for name, task in tasks.items():
            times[name].append(task())
    for name, values in times.items():
        found[f"{name}_ms"] = 1e3 * float(np.median(values))
    for ours in OURS:
        for peer in sorted(tasks.keys() - OURS.keys()):
            found[f"{ours}_over_{peer}"] = found[f"{ours}_ms"] / found[f"{peer}_ms"]
    return found


def main() -> None:
    """Print the comparison; fail if LAMMPS is too slow."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    found = compare()
    for name, value in sorted(found.items()):
        print(f"{name:40} {value:.3g}")
    ratio = min(found[f"{ours}_over_heyoka_look"] for ours in OURS)
    if ratio > LIMIT:
        raise SystemExit(f"LAMMPS takes {ratio:.2g} times as long as heyoka, wanted {LIMIT:g}")


if __name__ == "__main__":
    main()
