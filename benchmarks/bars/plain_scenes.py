"""
Compare error bars of cold chains, on fine grids of speed, with runs 1000 times tighter.

    python -m benchmarks.bars.plain_scenes [--count 20000] [--seed 1] [--particles 2 3 4]

Chains of one kind run in a batch. Chains that cannot run in a batch are omitted. Prints how many
errors exceed their error bars, and the median ratio of error bar to error.
"""

import argparse
from collections.abc import Sequence

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.batching import batch_kind, solve_batch
from chaincor.workflows.accuracy.plans import plans

_POTENTIALS = ("lj", "toda", "log", "power")
_SIZES = (2, 3, 3, 4, 5, 7, 10, 14, 20)
_TOGETHER, _TIGHTER = 250, 1e-3
# Smaller errors of the tighter run are rounding errors.
_ROUNDING = 2e-13


def compare_group(
    random: np.random.Generator, sizes: Sequence[int] = _SIZES
) -> list[tuple[Scene, float, float]]:
    """
    Return scenes of one kind at neighbouring speeds, each with its error bar and its error.

    The number of particles is drawn from `sizes`.
    """
    start = float(10.0 ** random.uniform(-2.5, 0.0))
    speeds = start * (1.0 + random.uniform(0.001, 0.01) * np.arange(_TOGETHER))
    potential, power = str(random.choice(_POTENTIALS)), {"power_order": 4, "power_c": 1.0}
    first = Scene(
        potential=potential,
        particles=int(random.choice(sizes)),
        speed=float(speeds[0]),
        engine="reference",
        tolerance=float(10.0 ** random.integers(-6, -3)),
        **(power if potential == "power" else {}),
    )
    scenes = [first.replace(speed=speed) for speed in speeds.tolist()]
    tight = [each.replace(tolerance=_TIGHTER * (each.tolerance or 0.0)) for each in scenes]
    kinds = [
        (batch_kind(scene), batch_kind(other)) for scene, other in zip(scenes, tight, strict=True)
    ]
    alike = [k for k, kind in enumerate(kinds) if None not in kind and kind == kinds[0]]
    if not alike:
        return []
    met, judged = (solve_batch(plans([each[k] for k in alike])) for each in (scenes, tight))
    return [
        (scenes[k], found[0].error, abs(found[0].outcome.eta - right))
        for k, found, judge in zip(alike, met, judged, strict=True)
        if found is not None and judge is not None
        for right in [judge[0].outcome.eta]
    ]


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--particles", type=int, nargs="+", default=_SIZES)
    given = parser.parse_args()
    random, ratios, outside = np.random.default_rng(given.seed), [], 0
    while len(ratios) < given.count:
        for scene, bar, error in compare_group(random, given.particles):
            ratios.append(bar / max(error, _ROUNDING))
            if error > bar + _ROUNDING:
                outside += 1
                print(f"outside by {error / bar:.3g} bars: {scene!r}", flush=True)
        if ratios:
            print(f"{outside} of {len(ratios)}, median {np.median(ratios):.3g}", flush=True)
    raise SystemExit(1 if outside > 1e-4 * len(ratios) else 0)


if __name__ == "__main__":
    main()
