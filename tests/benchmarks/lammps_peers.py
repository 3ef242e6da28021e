"""Print how long LAMMPS takes for eta to 1e-10 against heyoka and SciPy's DOP853.

All integrate a Lennard-Jones chain of 100 particles at 0.4 v*, each with its coarsest setting from
which on all finer ones are good. LAMMPS also shows that no contact follows the last. Its peers are
timed up to just past the last contact, which is less to do, and to the end of LAMMPS's argument.
Compiling and set-up are apart; times are those of the processor, whatever else the machine does.

Run: python -m tests.benchmarks.lammps_peers
"""

import argparse
from collections.abc import Callable

import numpy as np

from lammps_inputs.numerics import Numerics
from lammps_inputs.scene import Scene
from tests.benchmarks.peers import Dop853Chain, HeyokaChain, coarsest, timed
from workflows.engines import lammps
from workflows.step_search import eta_of
from workflows.tradeoff.truth import find_truth

ERROR = 1e-10
LIMIT = 5.0  # LAMMPS over heyoka, both to the end of the argument
STEPS = (0.2, 0.17, 0.15, 0.14, 0.12, 0.1, 0.085, 0.07)
MORE = 4
TOLERANCES = (1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13)


def lammps_seconds(scene: Scene, numerics: Numerics) -> float:
    """Return the time of an integration: what more runs after one set-up take."""
    one = timed(lambda: lammps.run_at_steps(scene, numerics, [numerics.timestep]))
    more = timed(lambda: lammps.run_at_steps(scene, numerics, [numerics.timestep] * (1 + MORE)))
    return (more - one) / MORE


def compare(repeats: int = 7) -> dict[str, float]:
    """Return settings, errors, times and ratios from one run."""
    scene = Scene(potential="lj", particles=100, speed=0.4)
    truth = find_truth(scene)
    last, end = truth.last_contact_time + 1e-3, truth.scouting.duration
    bond_range = truth.scouting.table_range(scene)

    def numerics(step: float) -> Numerics:
        return Numerics(scheme="order8", timestep=step, bond_range=bond_range)

    found: dict[str, float] = {}
    step, found["lammps_error"] = coarsest(
        STEPS,
        lambda h: abs(eta_of(scene, lammps.run(scene, numerics(h))) - truth.restitution),
        ERROR,
    )
    found["lammps_step"] = step
    tasks: dict[str, Callable[[], float]] = {
        "lammps": lambda: lammps_seconds(scene, numerics(step))
    }
    for name, kind in (("heyoka", HeyokaChain), ("dop853", Dop853Chain)):
        chains = {tolerance: kind(scene, tolerance) for tolerance in TOLERANCES}

        def error_of(tolerance: float, chains=chains) -> float:
            chain = chains[tolerance]
            velocities = chain.run(chain.start, 0.0, last)[scene.particles :]
            eta = (velocities.mean() / scene.impact_velocity) ** 2
            return abs(float(eta) - truth.restitution)

        tolerance, found[f"{name}_error"] = coarsest(TOLERANCES, error_of, ERROR)
        found[f"{name}_tolerance"] = tolerance
        chosen = chains[tolerance]
        for task, until in (("last", last), ("end", end)):
            tasks[f"{name}_{task}"] = lambda chain=chosen, until=until: timed(
                lambda: chain.run(chain.start, 0.0, until)
            )
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(repeats):
        for name, task in tasks.items():
            times[name].append(task())
    for name, values in times.items():
        found[f"{name}_ms"] = 1e3 * float(np.median(values))
    for name in tasks.keys() - {"lammps"}:
        found[f"lammps_over_{name}"] = found["lammps_ms"] / found[f"{name}_ms"]
    return found


def main() -> None:
    """Print the comparison and fail if LAMMPS is too slow."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    found = compare()
    for name, value in sorted(found.items()):
        print(f"{name:20} {value:.3g}")
    if found["lammps_over_heyoka_end"] > LIMIT:
        raise SystemExit(f"LAMMPS takes more than {LIMIT:g} times as long as heyoka")


if __name__ == "__main__":
    main()
