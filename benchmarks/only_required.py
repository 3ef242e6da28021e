"""
Measure the time saved by computing only what a scene requires.

    python -m benchmarks.only_required [--repeats 5]

For each saving, runs with and without it alternate, and their median processor times are compared.
Both must give the same eta. Prints a Markdown table.
"""

import argparse
import contextlib
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from unittest.mock import patch

from chaincor.lammps_inputs.bond_table import choose_rows
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.by_reference import converge
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.reference import adaptive, hard_sphere, modal, stepping
from chaincor.workflows.engines.reference.look_ahead import LookAhead
from chaincor.workflows.engines.reference.moving import Motion

# Error of the tabulated force: a thousandth of the error that v0 = 1e-3 and eta to 1e-9 allow.
FORCE_ERROR = 1e-12
WIDE = (0.8, 1.8)


@dataclass(frozen=True)
class Economy:
    """Two methods that give the same eta."""

    name: str
    scene: Scene
    lean: Callable[[Scene], float]
    full: Callable[[Scene], float]
    agreement: float


def step(scene: Scene, timestep: float = 0.2, frame_interval: float | None = None) -> float:
    """Return eta from steps of order 8."""
    numerics = Numerics(scheme="order8", timestep=timestep)
    return stepping.run(scene.problem, numerics, frame_interval).eta


def step_and_prove(scene: Scene) -> float:
    """Return eta from steps of order 8 that are reduced until two results agree."""
    return converge(scene.problem, 1e-10).restitution


def step_with_frames(scene: Scene) -> float:
    """Return eta; twenty frames are recorded while sound crosses the chain, as for a dump."""
    return step(scene, frame_interval=scene.particles / 20.0)


def step_to_the_end(scene: Scene) -> float:
    """Return eta; the end of the collision is detected with the steps of the run."""
    with patch.object(LookAhead, "settle", lambda *_: None):
        return step(scene)


@contextlib.contextmanager
def everything_moves() -> Iterator[None]:
    """Step all bonds from the start, including those that no sound has reached."""
    begin = Motion.at_start

    def all_active(*arguments):  # type: ignore[no-untyped-def]
        chain = begin(*arguments)
        chain.run_state.active = len(chain.strain)
        return chain

    with patch.object(Motion, "at_start", all_active):
        yield


def step_everything(scene: Scene) -> float:
    """Return eta; all bonds are stepped from the start."""
    with everything_moves():
        return step(scene)


def by_spheres(scene: Scene) -> float:
    """Return eta of hard spheres, after estimating its error."""
    assert hard_sphere.deviation(scene.problem) < 1e-6
    return hard_sphere.run(scene.problem).eta


def with_table(scene: Scene, bond_range: tuple[float, float]) -> float:
    """Return eta by LAMMPS with a table of this range and the number of rows that it needs."""
    numerics = Numerics(
        scheme="order6", timestep=0.1, bond_range=bond_range, force_error=FORCE_ERROR
    )
    return lammps.run(scene.problem, numerics).eta


SLOW = Scene(potential="lj", particles=100, speed=0.01)
NARROW = (0.998, 1.002)
ECONOMIES = (
    *(
        Economy(
            f"exact modes, not steps proved to 1e-10; harmonic, n = {n}",
            Scene(potential="harmonic", particles=n, velocity=0.1),
            lambda scene: modal.run(scene.problem).eta,
            step_and_prove,
            2e-10,
        )
        for n in (100, 1000)
    ),
    Economy(
        "hard spheres, not adaptive steps; lj, n = 100, 1000 v*",
        Scene(potential="lj", particles=100, speed=1000.0),
        by_spheres,
        lambda scene: adaptive.run(scene.problem, 1e-7).eta,
        1e-6,
    ),
    *(
        Economy(
            f"the end seen by looking ahead with coarse steps, not with those of the run; {name}",
            scene,
            step,
            step_to_the_end,
            0.0,
        )
        for name, scene in (
            ("lj, n = 100, 0.4 v*", Scene(potential="lj", particles=100, speed=0.4)),
            ("lj, n = 1000, 0.4 v*", Scene(potential="lj", particles=1000, speed=0.4)),
            ("lj, n = 100, 3 v*", Scene(potential="lj", particles=100, speed=3.0)),
        )
    ),
    Economy(
        "no step ahead of the sound; lj, n = 1000, 0.4 v*",
        Scene(potential="lj", particles=1000, speed=0.4),
        step,
        step_everything,
        1e-12,
    ),
    Economy(
        "no snapshots unless asked for; lj, n = 100, 0.4 v*",
        Scene(potential="lj", particles=100, speed=0.4),
        step,
        step_with_frames,
        0.0,
    ),
    Economy(
        "a table as narrow as the motion, not 0.8 to 1.8; LAMMPS, lj, n = 100, 0.01 v*",
        SLOW,
        lambda scene: with_table(scene, NARROW),
        lambda scene: with_table(scene, WIDE),
        1e-8,
    ),
)


def measure(economy: Economy, repeats: int) -> tuple[float, float]:
    """Return the median seconds of both methods, after one run of each that is not timed."""
    sides = (economy.lean, economy.full)
    etas = [side(economy.scene) for side in sides]
    away = abs(etas[0] - etas[1])
    if away > economy.agreement:
        raise AssertionError(f"{economy.name}: the two ways are {away:.2g} apart")
    seconds: tuple[list[float], list[float]] = ([], [])
    for _ in range(repeats):
        for side, times in zip(sides, seconds, strict=True):
            started = time.process_time()
            side(economy.scene)
            times.append(time.process_time() - started)
    return statistics.median(seconds[0]), statistics.median(seconds[1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="what it saves to model only what is required")
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    print("| economy | ms | ms without | ratio |")
    print("|---|---|---|---|")
    for economy in ECONOMIES:
        lean, full = measure(economy, arguments.repeats)
        print(f"| {economy.name} | {1e3 * lean:.3g} | {1e3 * full:.3g} | {full / lean:.2g} |")
    rows = [choose_rows(SLOW.bond, span, "spline", FORCE_ERROR) for span in (NARROW, WIDE)]
    print(f"rows of the table: {rows[0]} narrow, {rows[1]} wide")


if __name__ == "__main__":
    main()
