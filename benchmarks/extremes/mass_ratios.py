"""
Test chains of two alternating masses, with mass ratios from 1e-6 to 1e6.

    python -m benchmarks.extremes.mass_ratios [--particles 6] [--most-seconds 60]

Each ratio, bond and engine is run by `collide` to 1e-6. The judge ``tests.judge.bodies`` shares no
code with the engines. Prints a Markdown table with the error bar if the judge agrees, or with
`open` or `refused`. The exit status is 1 if an error exceeds its error bar.
"""

import argparse

from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from tests.judge.bodies import Unsure
from tests.judge.lines import judge_scene

# Mass ratios, beginning with those near 1. More extreme ratios take longer.
RATIOS = tuple(sorted((10.0**k for k in range(-6, 7) if k), key=lambda r: max(r, 1.0 / r)))
BONDS = ({"potential": "harmonic", "velocity": 0.1}, {"potential": "lj"}, {"potential": "toda"})
ENGINES = ("reference", "lammps")
_TOLERANCE = 1e-6


def cell(scene: Scene, most_seconds: float) -> str:
    """Return the result of a scene in a few words."""
    try:
        found = collide(scene, most_seconds=most_seconds)
    except ChaincorError as error:
        return f"refused ({type(error).__name__})"
    bar = found.restitution_error
    assert bar is not None
    if found.ending == "open":
        return f"open, {bar:.0e}"
    try:
        reference_value = judge_scene(scene, bar)
    except Unsure:
        return f"{bar:.0e}, not judged"
    if reference_value.error > bar:
        return f"{bar:.0e}, not judged"
    off = abs(found.restitution - reference_value.seen.restitution)
    return (
        f"{bar:.0e}"
        if off <= bar + 3.0 * reference_value.error
        else f"WRONG by {off:.0e}, bar {bar:.0e}"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("--particles", type=int, default=6)
    parser.add_argument("--most-seconds", type=float, default=60.0)
    given = parser.parse_args()
    columns = [(bond, engine) for bond in BONDS for engine in ENGINES]
    print("| ratio | " + " | ".join(f"{b['potential']}, {e}" for b, e in columns) + " |")
    print("|---" * (len(columns) + 1) + "|")
    wrong = False
    for ratio in RATIOS:
        cells = []
        for bond, engine in columns:
            scene = Scene(
                particles=given.particles,
                masses=(ratio, 1.0),
                engine=engine,
                tolerance=_TOLERANCE,
                **bond,
            )
            cells.append(cell(scene, given.most_seconds))
        wrong |= any("WRONG" in each for each in cells)
        print(f"| {ratio:g} | " + " | ".join(cells) + " |", flush=True)
    raise SystemExit(1 if wrong else 0)


if __name__ == "__main__":
    main()
