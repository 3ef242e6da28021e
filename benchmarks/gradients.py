"""Compare derivatives of eta with central differences, over scenes of all kinds; and their cost.

Prints for each scene the derivatives by its speed, and along a random direction of its masses, its
state, or by a parameter, beside differences of collisions at the tightest tolerance, extrapolated
to no difference (Ridders). Ends with 1 where one differs by more than asked.

Run: python -m benchmarks.gradients [--scenes 30] [--most 1e-6] [--seed 1]
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.in_house import stepping
from chaincor.workflows.result import Collision

Array = NDArray[np.float64]

_TIGHT = 1e-12
# Differences, in parts of the speed or of one, each 1.5 times smaller than the one before.
_LARGEST, _SHRUNK, _COUNT = 4e-4, 1.5, 7
_BONDS: tuple[dict[str, Any], ...] = (
    {"potential": "lj"},
    {"potential": "toda", "toda_b": 8.0},
    {"potential": "harmonic", "velocity": 0.1},
    {"potential": "log"},
    {"potential": "power", "power_order": 4, "power_c": 2.0},
    {"potential": "morse", "morse_a": 5.0},
    {
        "potential": "formula",
        "energy": "a*(r-1)^2+c*(r-1)^4",
        "parameters": {"a": 0.6, "c": 3.0},
        "velocity": 0.15,
    },
)


def scenes(count: int, seed: int, folder: Path) -> Iterator[dict[str, Any]]:
    """Yield what scenes are made of: the one of the first page, then kind after kind."""
    rng = np.random.default_rng(seed)
    yield {"potential": "lj", "particles": 100, "speed": 0.4}
    for number in range(1, count):
        fields = dict(_BONDS[number % len(_BONDS)], particles=int(rng.integers(3, 25)))
        if "velocity" not in fields:
            fields["speed"] = round(float(rng.uniform(0.1, 0.6)), 3)
        if number % 2:
            fields["masses"] = tuple(rng.uniform(0.5, 2.0, 3).round(3).tolist())
        if number % 3 == 1:
            fields["target_particles"] = int(rng.integers(1, 12))
            fields["target_masses"] = (round(float(rng.uniform(0.5, 3.0)), 3),)
        if number % 5 in (2, 4):
            fields["contact"] = "power"
            fields["contact_stiffness"] = round(float(rng.uniform(0.5, 5.0)), 3)
            fields["contact_exponent"] = (1.0, 1.5)[number % 4 == 0]
        if number % 4 == 3:
            scene = Scene(**fields)
            warm = scene.replace(temperature=0.05 * scene.impact_velocity**2, seed=number)
            _write_state(folder / f"{number}.csv", warm, np.zeros(0))
            fields = {k: v for k, v in fields.items() if k not in ("masses", "speed", "velocity")}
            fields["initial"] = str(folder / f"{number}.csv")
        yield fields


def _write_state(path: Path, scene: Scene, change: Array) -> None:
    """Write the state of a scene's chain, with a change of gap, strains, velocities and masses."""
    line = scene.line
    places, v = line.strains[line.gap :], line.velocities[line.first :]
    state = np.concatenate((places, v, line.chain_masses))
    state = (state + change if len(change) else state).reshape(3, -1)
    rows = [",".join(repr(float(each)) for each in row) for row in state.T]
    path.write_text("\n".join(["strain,velocity,mass", *rows]) + "\n")


def directions(
    scene: Scene, result: Collision, rng: np.random.Generator, folder: Path
) -> Iterator[tuple[str, float, Callable[[float], Scene], float]]:
    """Yield names, derivatives, changed scenes, and what size a change has."""
    found, n = result.sensitivity, scene.particles
    if scene.initial is not None:
        whole = np.concatenate(([-found.wall_place], found.strains, found.velocities, found.masses))
        scale = np.repeat([0.1 * scene.impact_velocity, scene.impact_velocity, 1.0], n)
        towards = scale * rng.standard_normal(3 * n)

        def elsewhere(change: float) -> Scene:
            _write_state(folder / "changed.csv", scene, change * towards)
            return scene.replace(initial=str(folder / "changed.csv"))

        yield "state", float(whole @ towards), elsewhere, 1.0
    else:
        v0 = scene.impact_velocity
        if not scene.bond.is_harmonic or scene.line.soft:

            def faster(change: float) -> Scene:
                return scene.without("speed").replace(velocity=v0 + change)

            yield "speed", found.velocity, faster, v0
        masses, at = scene.line.chain_masses, rng.standard_normal(n)

        def heavier(change: float) -> Scene:
            changed = tuple((masses + change * at).tolist())
            return scene.without("speed").replace(velocity=v0, masses=changed)

        yield "masses", float(found.masses @ at), heavier, 1.0
    for name, slope in found.parameters.items():
        value = (scene.parameters or {}).get(name) or getattr(scene, name)

        def steeper(change: float, name: str = name, value: float = value) -> Scene:
            given = scene.parameters or {}
            fixed = scene if scene.initial else scene.without("speed")
            keep = {} if scene.initial else {"velocity": scene.impact_velocity}
            now = {name: value + change}
            return fixed.replace(**keep, **({"parameters": given | now} if given else now))

        yield name, slope, steeper, value
    if found.contact_stiffness is not None:
        k = scene.line.contact_stiffness

        def stiffer(change: float) -> Scene:
            return scene.replace(contact_stiffness=k + change)

        yield "stiffness", found.contact_stiffness, stiffer, k


def difference(changed: Callable[[float], Scene], size: float) -> tuple[float, float]:
    """Return a derivative by central differences, extrapolated, and how far it may be off."""
    table: list[list[float]] = []
    best, off = 0.0, np.inf
    for row in range(_COUNT):
        h = size * _LARGEST / _SHRUNK**row
        up, down = (collide(changed(s * h), _TIGHT).restitution for s in (1.0, -1.0))
        now = [(up - down) / (2.0 * h)]
        for k in range(row):
            factor = _SHRUNK ** (2.0 * (k + 1))
            now.append(now[k] + (now[k] - table[-1][k]) / (factor - 1.0))
            spread = max(abs(now[k + 1] - now[k]), abs(now[k + 1] - table[-1][k]))
            if spread <= off:
                best, off = now[k + 1], spread
        table.append(now)
    return best, float(off)


def cost(scene: Scene, result: Collision) -> float:
    """Return how many runs with the same step a derivative takes, by processor time."""
    from chaincor.workflows.sensitivity.sensitivity import gradient
    from chaincor.workflows.sensitivity.trace import SCHEME, trace

    step = result.sensitivity.step

    def run() -> None:
        stepping.run(scene, Numerics(scheme=SCHEME, timestep=step))

    def differentiate() -> None:
        gradient(trace(scene, step, result.contacts, result.duration), [])

    times = []
    for work in (run, differentiate):
        taken = []
        for _ in range(5):
            begun = time.process_time()
            work()
            taken.append(time.process_time() - begun)
        times.append(min(taken))
    return times[1] / times[0]


def main() -> None:
    """Print the comparisons; exit with 1 where one fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=30)
    parser.add_argument("--most", type=float, default=1e-6)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng, missed, worst = np.random.default_rng(given.seed), 0, 0.0
    with tempfile.TemporaryDirectory() as name:
        for fields in scenes(given.scenes, given.seed, Path(name)):
            scene = Scene(engine="reference", **fields)
            result = collide(scene, _TIGHT)
            runs = cost(scene, result)
            print(f"{fields}: eta {result.restitution:.9f}, {runs:.1f} runs", flush=True)
            for what, slope, changed, size in directions(scene, result, rng, Path(name)):
                if abs(slope * size) < 1e-9:
                    continue  # none, by symmetry
                measured, off = difference(changed, size)
                relative = abs(slope - measured) / abs(slope)
                # What differences themselves leave open says nothing.
                fails = relative > given.most + off / abs(slope)
                missed, worst = missed + fails, max(worst, relative)
                print(
                    f"  {what:12} {slope:+.12g} {measured:+.12g} +- {off:.1e}, "
                    f"differ by {relative:.1e}{'  TOO MUCH' if fails else ''}",
                    flush=True,
                )
    print(f"largest relative difference {worst:.1e}; {missed} above {given.most:g}")
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
