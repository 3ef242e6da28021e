"""
Compare `collide` with the judge for random scenes of two bodies on a line.

    python -m tests.judge.lines -o FILE [--count 300] [--seed 1] [--processes 1]
        [--engine reference|lammps] [--kind line|warm|heavy] [--most-seconds 300]

The judge is that of ``bodies``, which shares no code with the engines. The program writes one line
of JSON for every scene; a study that was stopped continues from there. The verdicts are: *inside*
the error bar; *outside*, with the ratio of error to bar; *open*, if `collide` calls the end open;
*refused*, with the name of the error; *judge unsure*.
"""

import argparse
import json
import multiprocessing
import tempfile
import time
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.scenes.lines import draw_heavy_scene, draw_line_scene
from benchmarks.scenes.warm import draw_warm_scene
from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from tests.judge.bodies import CLOSER, Bodies, Bonds, Judgement, Unsure, judge

# The judge follows the motion up to this multiple of the collision's duration. The multiple is
# smaller if the end is called open.
MULTIPLE, MULTIPLE_OPEN = 20.0, 3.0
# The judge is certain if its error is below this fraction of the error bar, or below this value.
_SHARE, _SHARPEST = 0.2, 2e-12
# Rounding error of the judge for an eta up to 1. A warm chain may return faster than it came; the
# rounding error is then relative to eta.
_ROUNDING = 1e-12


def bonds_of(scene: Scene) -> Bonds:
    """Return the law of a scene's bonds, for the judge."""
    if scene.potential == "toda":
        return Bonds("toda", float(scene.toda_b or 10.0))
    if scene.potential == "power":
        return Bonds("power", float(scene.power_c or 0.0), float(scene.power_order or 0))
    if scene.potential == "morse":
        steepness = scene.bond.parameters.a
        return Bonds("morse", 0.5 / steepness**2, steepness)
    return Bonds(str(scene.potential))


def bodies_of(scene: Scene) -> Bodies:
    """Return the bodies of a scene, for the judge."""
    line = scene.line
    return Bodies(
        line.masses,
        line.velocities,
        line.strains,
        line.first,
        *(line.contact.parameters if line.soft else (0.0, 1.5)),
    )


def judge_scene(scene: Scene, bar: float, multiple: float = MULTIPLE) -> Judgement:
    """Judge a scene, with steps as short as its error bar requires."""
    found: Judgement | None = None
    for closer in CLOSER:
        found = judge(bonds_of(scene), bodies_of(scene), closer=closer, multiple=multiple)
        if found.error <= max(_SHARE * bar, _SHARPEST):
            break
    assert found is not None
    return found


def draw(seed: int, index: int, engine: str | None, folder: Path, kind: str = "line") -> Scene:
    """Return one scene of the study: the first valid scene from its own random numbers."""
    for attempt in range(100):
        random = np.random.default_rng([seed, index, attempt])
        try:
            if kind == "warm":
                return draw_warm_scene(random, engine)
            if kind == "heavy":
                return draw_heavy_scene(random, engine)
            scene = draw_line_scene(random, folder, engine)
        except ChaincorError:
            continue
        if not scene.line.is_standard:
            return scene
    raise AssertionError("no valid scene in 100")


def try_scene(
    index: int, *, seed: int, engine: str | None, kind: str, most_seconds: float
) -> dict[str, Any]:
    """Run one scene and judge it."""
    with tempfile.TemporaryDirectory() as folder:
        scene = draw(seed, index, engine, Path(folder), kind)
        return _try(scene, {"index": index, **describe(scene)}, most_seconds)


def describe(scene: Scene) -> dict[str, Any]:
    """Return the description of a scene for its line of output."""
    line = scene.line
    free = line.masses[np.isfinite(line.masses)]
    return {
        "potential": scene.potential,
        "particles": scene.particles,
        "target": line.targets,
        "mass_ratio": float(free.max() / free.min()),
        "contact": line.contact.identity if line.soft else "hard",
        "start": _start_of(scene),
        "velocity": scene.impact_velocity,
        "speed": scene.speed,
        "engine": scene.engine,
        "asked": scene.tolerance,
    }


def _start_of(scene: Scene) -> str:
    if scene.temperature is not None:
        return f"T={scene.temperature:.3g} seed {scene.seed}"
    return "file" if scene.initial else "compressed" if scene.compression else "cold"


def _try(scene: Scene, row: dict[str, Any], most_seconds: float) -> dict[str, Any]:
    begun = time.process_time()
    try:
        found = collide(scene, most_seconds=most_seconds)
    except ChaincorError as error:
        return row | {
            "verdict": "refused",
            "name": type(error).__name__,
            "reason": str(error)[:300],
            "seconds": time.process_time() - begun,
        }
    row |= {
        "seconds": time.process_time() - begun,
        "ending": found.ending,
        "scheme": found.scheme,
        "eta": found.restitution,
        "bar": found.restitution_error,
        "contacts": found.contacts,
        "last": found.last_contact_time,
        "tolerance_met": found.tolerance_met,
        "reason": found.reason,
        "crossed": found.crossed,
    }
    begun = time.process_time()
    is_open = found.ending == "open"
    try:
        reference_value = judge_scene(
            scene, found.restitution_error, MULTIPLE_OPEN if is_open else MULTIPLE
        )
    except Unsure as error:
        return row | {"verdict": "judge unsure", "judge_reason": str(error)}
    seen = reference_value.seen
    off = abs(found.restitution - seen.restitution)
    row |= {
        "judge": seen.restitution,
        "judge_error": reference_value.error,
        "judge_contacts": seen.contacts,
        "judge_last": seen.last_contact - seen.first_contact,
        "judge_drift": seen.energy_drift,
        "judge_seconds": time.process_time() - begun,
        "bars": off / max(found.restitution_error, 1e-300),
    }
    if not reference_value.error <= 1e-4:
        verdict = "judge unsure"
    elif is_open:
        verdict = "open"
    elif off > found.restitution_error + 3.0 * reference_value.error + _ROUNDING * max(
        found.restitution, 1.0
    ):
        verdict = "outside"
    else:
        verdict = "inside"
    return row | {"verdict": verdict}


def report(rows: list[dict[str, Any]]) -> bool:
    """Print the counts; return whether at least 99 % of judged scenes are inside their bars."""
    print(f"scenes: {len(rows)}")
    for (engine, verdict), count in sorted(
        Counter((row["engine"], row["verdict"]) for row in rows).items()
    ):
        print(f"  {engine:10} {verdict:14} {count}")
    names = Counter((row["engine"], row["name"]) for row in rows if row["verdict"] == "refused")
    for (engine, name), count in sorted(names.items()):
        print(f"  refused by {engine}: {name} {count}")
    judged = [row for row in rows if row["verdict"] in ("inside", "outside")]
    inside = sum(row["verdict"] == "inside" for row in judged)
    differ = sum(row["contacts"] != row["judge_contacts"] for row in judged)
    met = sum(bool(row["tolerance_met"]) for row in judged)
    print(f"inside: {inside}/{len(judged)}; tolerance met: {met}; contacts differ: {differ}")
    for row in rows:
        if row["verdict"] == "outside":
            print(f"  outside by {row['bars']:.3g} bars: {_line(row)}")
    for row in rows:
        if row["verdict"] == "open":
            print(f"  open, at {row['bars']:.3g} bars: {_line(row)}")
    for row in rows:
        if row["verdict"] == "judge unsure":
            known = row.get("judge_reason") or f"to {row['judge_error']:.1g}"
            print(f"  judge unsure ({known}): {_line(row)}")
    for name in dict.fromkeys(name for _, name in names):
        example = next(row for row in rows if row.get("name") == name)
        print(f"  {name}, as {example['index']}: {example['reason'][:160]}")
    return inside >= 0.99 * len(judged)


def _line(row: dict[str, Any]) -> str:
    text = (
        f"{row['index']} {row['engine']} {row['potential']} n={row['particles']} "
        f"M={row['target']} masses 1:{row['mass_ratio']:.3g} contact {row['contact']} "
        f"{row['start']} v0={row['velocity']:.4g} asked {row['asked']:.1g} {row['scheme']}: "
        f"{row['eta']:.10f} +- {row['bar']:.1e}, {row['contacts']} contacts, {row['ending']}"
    )
    if "judge" not in row:
        return text
    return (
        f"{text}; judge {row['judge']:.10f} +- {row['judge_error']:.0e}, "
        f"{row['judge_contacts']} contacts"
    )


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--engine", choices=["lammps", "reference"], help="one engine only")
    parser.add_argument(
        "--kind", choices=["line", "warm", "heavy"], default="line", help="of scenes"
    )
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--most-seconds", type=float, default=300.0, help="a collision may take")
    given = parser.parse_args()
    rows: dict[int, dict[str, Any]] = {}
    if given.output.exists():
        rows = {r["index"]: r for r in map(json.loads, given.output.read_text().splitlines())}
    missing = [index for index in range(given.count) if index not in rows]
    attempt = partial(
        try_scene,
        seed=given.seed,
        engine=given.engine,
        kind=given.kind,
        most_seconds=given.most_seconds,
    )
    pool = multiprocessing.get_context("spawn").Pool(given.processes)
    with pool, given.output.open("a") as file:
        for row in pool.imap_unordered(attempt, missing):
            rows[row["index"]] = row
            file.write(json.dumps(row) + "\n")
            file.flush()
    raise SystemExit(0 if report([row for _, row in sorted(rows.items())]) else 1)


if __name__ == "__main__":
    main()
