"""Print the ratio of the stock wall's error to the event wall's error in the same time.

The stock wall is fix wall/reflect with Verlet steps of 0.005. Both walls alternate in LAMMPS, each
with eight nearby time steps. Errors are root mean squares, and times are medians.

Run: python -m benchmarks.peers.equal_time
"""

import argparse
from dataclasses import dataclass

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.tradeoff.reference_solution import find_reference
from chaincor.workflows.tradeoff.settings import (
    STOCK_PHASES,
    Measurement,
    Setting,
    stock_setting,
    time_unit,
)

SCENES = (
    {"potential": "harmonic", "velocity": 0.1},
    {"potential": "lj", "speed": 0.1},
    {"potential": "lj", "speed": 0.4},
    {"potential": "lj", "speed": 1.0},
)
# Steps in units of 1/frequency of the most compressed bond.
STEPS = {
    "verlet": (0.1, 0.05, 0.025, 0.0125),
    "order6": (0.56, 0.4, 0.28, 0.2),
    "order8": (0.8, 0.67, 0.56, 0.48, 0.4, 0.34, 0.28, 0.2, 0.14, 0.1, 0.07),
}
# Required geometric means of the ratio, in 1 and 4 times the time of the stock wall.
WANTED = {1: 300.0, 4: 1e6}


@dataclass(frozen=True)
class EqualTime:
    """Ratio of errors in a scene, and setting of the event wall, by factor of the time."""

    name: str
    stock_error: float
    stock_seconds: float
    ratios: dict[int, float]
    best: dict[int, str]


def compare(fields: dict, phases: int = STOCK_PHASES) -> EqualTime:
    """Measure the ratios of errors in a scene."""
    scene = Scene(particles=100, **fields)
    reference_value = find_reference(scene)
    spline = None if fields["potential"] == "harmonic" else "spline"
    stock = Measurement(stock_setting(scene))
    unit = time_unit(scene, "event")
    events = [
        Measurement(Setting("lammps", "event", scheme, spline, unit * step))
        for scheme, steps in STEPS.items()
        for step in steps
    ]
    for phase in range(phases):
        for each in (stock, *events):
            if each.failure is None:
                each.run(reference_value, phase / phases)
    ratios, best = {}, {}
    for factor in WANTED:
        quick = [e for e in events if not e.failure and e.time <= factor * stock.time]
        chosen = min(quick, key=lambda e: e.rms_error)
        floor = max(chosen.rms_error, reference_value.restitution_error)
        ratios[factor] = stock.rms_error / floor
        setting = chosen.setting
        best[factor] = f"{setting.scheme} H {setting.timestep:.3g}: {floor:.1e}"
    name = " ".join(str(value) for value in fields.values())
    return EqualTime(name, stock.rms_error, stock.time, ratios, best)


def geometric_mean(results: list[EqualTime], factor: int) -> float:
    """Return the mean ratio of errors for a factor of the stock wall's time."""
    return float(np.exp(np.mean([np.log(result.ratios[factor]) for result in results])))


def main() -> None:
    """Print the ratios; fail if a mean is below the required mean."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    print("| scene | stock error | stock ms | ratio | by | ratio at 4 times | by |")
    print("|---|---|---|---|---|---|---|")
    results = []
    for fields in SCENES:
        result = compare(fields)
        results.append(result)
        print(
            f"| {result.name} | {result.stock_error:.1e} | {1e3 * result.stock_seconds:.0f} "
            f"| {result.ratios[1]:.2g} | {result.best[1]} "
            f"| {result.ratios[4]:.2g} | {result.best[4]} |",
            flush=True,
        )
    missed = []
    for factor, wanted in WANTED.items():
        mean = geometric_mean(results, factor)
        print(f"geometric mean at {factor} times the time: {mean:.3g}")
        if mean < wanted:
            missed.append(f"{mean:.2g} at {factor} times the time, wanted {wanted:g}")
    if missed:
        raise SystemExit("; ".join(missed))


if __name__ == "__main__":
    main()
