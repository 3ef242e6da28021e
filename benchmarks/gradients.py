r"""Compare derivatives of eta with central differences in scenes of all kinds, and their cost.

In each scene, eta is differentiated with respect to the speed or a parameter, or along a random
direction of the masses or the initial state. Each derivative is compared with central differences,
computed by order 8 at half the time step and extrapolated to zero difference (Ridders). For each
scene, a row of docs/sensitivity.md is printed with the worst derivative and the cost of the
derivatives, in runs at the same time step. The exit status is 1 if a derivative differs by more
than allowed.

A derivative may be a sum of large terms that cancel; a harmonic chain, for example, has the same
eta at any speed. Differences are therefore given relative to the size of the terms. Along a
direction, the terms are those of the components. For the derivative of :math:`\eta = (V_1/V_0)^2`
with respect to :math:`V_0`, one of two terms is :math:`2 \eta/V_0`.

Run: python -m benchmarks.gradients [--scenes 30] [--most 1e-6] [--seed 1] [--each]
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.reference import stepping
from chaincor.workflows.result import Collision
from chaincor.workflows.sensitivity.sensitivity import gradient
from chaincor.workflows.sensitivity.trace import SCHEME, trace

Array = NDArray[np.float64]

# Largest difference relative to the speed or to 1, the factor between two differences, and their
# number.
_LARGEST, _SHRUNK, _COUNT = 4e-4, 1.5, 7
# Factors of the largest difference in further attempts, until the error is at most this fraction of
# the allowed difference.
_CLOSER, _SHARE = (0.03, 1e-3, 1e-5), 0.3
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
    """Yield the keys of scenes: first two long chains, one of which breaks, then all kinds."""
    rng = np.random.default_rng(seed)
    yield {"potential": "lj", "particles": 100, "speed": 0.4}
    yield {"potential": "lj", "particles": 100, "speed": 1.0}
    for number in range(1, count - 1):
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
    """Write the initial state of a chain, with a change of gap, strains, velocities and masses."""
    line = scene.line
    places, v = line.strains[line.gap :], line.velocities[line.first :]
    state = np.concatenate((places, v, line.chain_masses))
    state = (state + change if len(change) else state).reshape(3, -1)
    rows = [",".join(repr(float(each)) for each in row) for row in state.T]
    path.write_text("\n".join(["strain,velocity,mass", *rows]) + "\n")


class Direction(NamedTuple):
    """Name, derivative, summed size of its terms, function that changes the scene, and scale."""

    name: str
    slope: float
    terms: float
    changed: Callable[[float], Scene]
    size: float


def directions(
    scene: Scene, result: Collision, rng: np.random.Generator, folder: Path
) -> Iterator[Direction]:
    """Yield the directions in which a scene is changed."""
    found, n = result.sensitivity, scene.particles
    if scene.initial is not None:
        whole = np.concatenate(([-found.wall_place], found.strains, found.velocities, found.masses))
        scale = np.repeat([0.1 * scene.impact_velocity, scene.impact_velocity, 1.0], n)
        towards = scale * rng.standard_normal(3 * n)

        def elsewhere(change: float) -> Scene:
            _write_state(folder / "changed.csv", scene, change * towards)
            return scene.replace(initial=str(folder / "changed.csv"))

        yield Direction("state", *_along(whole, towards), elsewhere, 1.0)
    else:
        v0 = scene.impact_velocity

        def faster(change: float) -> Scene:
            return scene.without("speed").replace(velocity=v0 + change)

        yield Direction("speed", found.velocity, 2.0 * result.restitution / v0, faster, v0)
        masses, at = scene.line.chain_masses, rng.standard_normal(n)

        def heavier(change: float) -> Scene:
            changed = tuple((masses + change * at).tolist())
            return scene.without("speed").replace(velocity=v0, masses=changed)

        yield Direction("masses", *_along(found.masses, at), heavier, 1.0)
    for name, slope in found.parameters.items():
        value = (scene.parameters or {}).get(name) or getattr(scene, name)

        def steeper(change: float, name: str = name, value: float = value) -> Scene:
            given = scene.parameters or {}
            fixed = scene if scene.initial else scene.without("speed")
            keep = {} if scene.initial else {"velocity": scene.impact_velocity}
            now = {name: value + change}
            return fixed.replace(**keep, **({"parameters": given | now} if given else now))

        yield Direction(name, slope, abs(slope), steeper, value)
    if found.contact_stiffness is not None:
        k = scene.line.contact.strength

        def stiffer(change: float) -> Scene:
            return scene.replace(contact_stiffness=k + change)

        yield Direction(
            "stiffness", found.contact_stiffness, abs(found.contact_stiffness), stiffer, k
        )


def _along(derivatives: Array, towards: Array) -> tuple[float, float]:
    """Return the derivative along a direction, and the summed size of its terms."""
    terms = derivatives * towards
    return float(np.sum(terms)), float(np.sum(np.abs(terms)))


def difference(
    changed: Callable[[float], Scene], size: float, step: float, wanted: float
) -> tuple[float, float]:
    """Return a derivative from extrapolated central differences, and its error."""
    best, off = _extrapolated(changed, size * _LARGEST, step)
    for closer in _CLOSER:
        # Chains that break have other contacts after larger changes, and differences do not
        # converge.
        if off <= wanted:
            break
        nearer = _extrapolated(changed, size * _LARGEST * closer, step)
        best, off = min((best, off), nearer, key=itemgetter(1))
    return best, off


def _extrapolated(
    changed: Callable[[float], Scene], largest: float, step: float
) -> tuple[float, float]:
    table: list[list[float]] = []
    best, off = 0.0, np.inf
    for row in range(_COUNT):
        h = largest / _SHRUNK**row
        up, down = (_eta(changed(s * h), step) for s in (1.0, -1.0))
        now = [(up - down) / (2.0 * h)]
        for k in range(row):
            factor = _SHRUNK ** (2.0 * (k + 1))
            now.append(now[k] + (now[k] - table[-1][k]) / (factor - 1.0))
            spread = max(abs(now[k + 1] - now[k]), abs(now[k + 1] - table[-1][k]))
            if spread <= off:
                best, off = now[k + 1], spread
        table.append(now)
    return best, float(off)


def _eta(scene: Scene, step: float) -> float:
    return stepping.run(scene.problem, Numerics(scheme=SCHEME, timestep=step)).eta


def cost(scene: Scene, result: Collision) -> float:
    """Return the processor time of the derivatives, in units of a run at the same time step."""
    step = result.sensitivity.step

    def run() -> None:
        stepping.run(scene.problem, Numerics(scheme=SCHEME, timestep=step))

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
    """Print the comparisons; exit with 1 if one fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=30)
    parser.add_argument("--most", type=float, default=1e-6)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--each", action="store_true", help="print every derivative")
    given = parser.parse_args()
    rng, missed, worst, costs = np.random.default_rng(given.seed), 0, 0.0, []
    print("| scene | eta | derivatives | differ by, at most | differences good to | runs |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        for fields in scenes(given.scenes, given.seed, Path(name)):
            scene = Scene(engine="reference", **fields)
            result = collide(scene, 1e-10)
            printed, largest, open_ = [], 0.0, 0.0
            for what, slope, terms, changed, size in directions(scene, result, rng, Path(name)):
                scale = max(abs(slope), terms)
                wanted, half = _SHARE * given.most * scale, 0.5 * result.sensitivity.step
                measured, off = difference(changed, size, half, wanted)
                differ, unsure = abs(slope - measured) / scale, off / scale
                # If the error of the differences is larger, the comparison fails as well.
                fails = differ > given.most or unsure > given.most
                missed += fails
                largest, open_ = max(largest, differ), max(open_, unsure)
                printed.append(what + (" TOO MUCH" if fails else ""))
                if given.each:
                    print(f"  {what:12} {slope:+.12g} {measured:+.12g} +- {off:.1e}", flush=True)
            runs = cost(scene, result)
            costs.append(runs)
            worst = max(worst, largest)
            print(
                f"| {_described(scene)} | {result.restitution:.6f} | {', '.join(printed)} | "
                f"{largest:.1e} | {open_:.1e} | {runs:.1f} |",
                flush=True,
            )
    print(
        f"largest difference {worst:.1e}; {missed} above {given.most:g}; "
        f"cost {np.median(costs):.1f} runs, {max(costs):.1f} at most"
    )
    sys.exit(1 if missed else 0)


def _described(scene: Scene) -> str:
    """Return a short description of a scene."""
    line, words = scene.line, [f"{scene.particles} {scene.potential}"]
    if scene.masses:
        words.append("unequal masses")
    if scene.initial:
        words.append("warm")
    if not line.rigid:
        words.append(f"target of {line.targets}")
    if line.soft:
        words.append(f"contact of exponent {line.contact.parameters[1]:g}")
    return ", ".join([*words, f"{scene.impact_velocity:.3g}"])


if __name__ == "__main__":
    main()
