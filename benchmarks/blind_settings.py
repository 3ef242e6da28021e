"""Test the cheapest settings, found in one scene, in twenty other scenes.

`chaincor tradeoff` finds the cheapest settings for a Lennard-Jones chain of 100 particles at 0.4
v*. LAMMPS then uses each row of its table in random scenes, which were not used to find the
settings. A row is right if the error is at most twice the predicted error. If the rounding error is
larger than the predicted error, the rounding error is used instead.

Run: python -m benchmarks.blind_settings
"""

import argparse
from dataclasses import replace

import numpy as np

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.rounding import rounding_error
from chaincor.workflows.errors import RunError
from chaincor.workflows.tradeoff.front import CheapestRow
from chaincor.workflows.tradeoff.reference_solution import find_reference
from chaincor.workflows.tradeoff.settings import time_unit
from chaincor.workflows.tradeoff.study import tradeoff

SCENES = 20
KEEPS, BREAKS = 2.0, 10.0
WANTED_SHARE = 0.9
_POTENTIALS = ("lj", "toda", "log", "harmonic", "power")


def draw_scenes(seed: int) -> list[Scene]:
    """Return random scenes: all potentials, 20 to 200 particles and 0.03 to 1 v*, log-uniform."""
    rng = np.random.default_rng(seed)
    scenes = []
    for k in range(SCENES):
        potential = _POTENTIALS[k % len(_POTENTIALS)]
        particles = round(float(20.0 * 10.0 ** rng.uniform(0.0, 1.0)))
        speed = float(0.03 * (1.0 / 0.03) ** rng.uniform())
        fields: dict = {"potential": potential, "particles": particles}
        # Particles pass each other in a quartic chain above 0.7 v*, and in a harmonic chain above
        # v0 = 0.69.
        if potential == "harmonic":
            fields["velocity"] = 0.5 * speed
        else:
            fields["speed"] = 0.6 * speed if potential == "power" else speed
        if potential == "power":
            fields |= {"power_order": 4, "power_c": 1.0}
        scenes.append(Scene(**fields))
    return scenes


def numerics_in(scene: Scene, row: CheapestRow) -> Numerics:
    """Return a row's numerics for another scene; the step is scaled with the fastest bond."""
    step = row.scaled_timestep * time_unit(scene, row.setting.wall)
    return replace(row.setting, timestep=step).numerics(scene)


def promised_in(scene: Scene, row: CheapestRow) -> float:
    """Return the predicted error of a row in another scene, at least the rounding error."""
    return max(row.error, rounding_error(row.setting.engine, scene.problem))


def errors_over_promises(scene: Scene, rows: list[CheapestRow]) -> np.ndarray:
    """Return the error divided by the predicted error for each row in a new scene."""
    reference_value = find_reference(scene)
    found = []
    for row in rows:
        try:
            outcome = lammps.run(scene.problem, numerics_in(scene, row))
        except RunError:
            found.append(np.inf)
            continue
        error = max(
            abs(outcome.eta - reference_value.restitution) - reference_value.restitution_error, 0.0
        )
        found.append(error / promised_in(scene, row))
    return np.array(found)


def main() -> None:
    """Print the ratios of errors to predictions; fail if too many predictions were wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="measure the table quickly")
    parser.add_argument("--seed", type=int, default=4)
    arguments = parser.parse_args()
    study = tradeoff(Scene(), quick=arguments.quick)
    rows = study.cheapest["lammps"]
    print("promises:", *(f"{row.error:.0e}" for row in rows))
    worst, every = [], []
    for scene in draw_scenes(arguments.seed):
        ratios = errors_over_promises(scene, rows)
        worst.append(ratios.max())
        every.extend(ratios)
        speed = "" if scene.speed is None else f" at {scene.speed:.3f} v*"
        print(
            f"{scene.label} n = {scene.particles}{speed}: error/promise",
            *(f"{ratio:.2g}" for ratio in ratios),
            flush=True,
        )
    share = float(np.mean(np.array(every) <= KEEPS))
    scenes = float(np.mean(np.array(worst) <= KEEPS))
    print(f"kept within {KEEPS:g}: {share:.1%} of rows, all rows of {scenes:.0%} of scenes")
    print(f"worst: {max(worst):.2g} times the promise")
    if scenes < WANTED_SHARE or max(worst) > BREAKS:
        raise SystemExit("too many promises were broken")


if __name__ == "__main__":
    main()
