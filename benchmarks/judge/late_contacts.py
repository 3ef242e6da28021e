"""
Are contacts missed? Random scenes of breaking chains against the judge that simply runs on.

    python -m benchmarks.judge.late_contacts -o FILE [--count 3500] [--seed 1] [--processes 2]
        [--tolerance 1e-8] [--engine reference] [--multiple 20]

Five of seven scenes are lj with 5 to 160 particles at 1.2 to 1.8 v*, the others toda, log and power
in turn, where their chains rattle longest. Each is one line of JSON in FILE; scenes that are there
already are not run again. Prints how runs ended, and each that the judge does not confirm. Exit
status 1 where a contact or a bar is wrong in a run that does not call its end open.
"""

import argparse
import json
import multiprocessing
import time
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.judge.judge import JudgeRefusal, Law, judge_collision
from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide

_LJ_SHARE, _CYCLE = 5, 7
_OTHERS = ("toda", "log", "power")
# Speeds in v*; power of odd order runs away over its barrier at about 0.3 v*.
_SPEEDS = {"lj": (1.2, 1.8), "toda": (0.8, 3.0), "log": (0.6, 1.8), "power": (0.4, 1.6)}
_ODD_POWER_SPEEDS = (0.03, 0.3)
Row = dict[str, Any]


def draw_scene(seed: int, index: int, engine: str) -> Scene:
    """Return scene `index` of a seed, whatever others are drawn."""
    random = np.random.default_rng([seed, index])
    turn, other = index % _CYCLE, index // _CYCLE
    name = "lj" if turn < _LJ_SHARE else _OTHERS[(2 * other + turn - _LJ_SHARE) % len(_OTHERS)]
    fields: dict[str, Any] = {"potential": name, "engine": engine}
    fields["particles"] = int(random.integers(5, 161))
    speeds = _SPEEDS[name]
    if name == "toda":
        fields["toda_b"] = float(random.choice([5.0, 10.0, 30.0]))
    if name == "power":
        order = int(random.integers(3, 8))
        fields |= {"power_order": order, "power_c": 1.0 if order % 2 == 0 else -1.0}
        speeds = speeds if order % 2 == 0 else _ODD_POWER_SPEEDS
    return Scene(**fields, speed=float(random.uniform(*speeds)))


def law_of(scene: Scene) -> Law:
    """Return the judge's law of a scene with a named potential."""
    if scene.potential == "power":
        return Law("power", order=scene.power_order, c=scene.power_c)
    return (
        Law(scene.potential, b=scene.toda_b) if scene.potential == "toda" else Law(scene.potential)
    )


def try_scene(
    index: int, seed: int, engine: str, tolerance: float, multiple: float, accuracy: float = 1e-2
) -> Row:
    """Run one scene and have it judged."""
    scene = draw_scene(seed, index, engine)
    row: Row = {"index": index, "seed": seed, "tolerance": tolerance, "multiple": multiple}
    row |= {"engine": engine, "potential": scene.label, "particles": scene.particles}
    row |= {"speed": scene.speed, "velocity": scene.impact_velocity}
    started = time.perf_counter()
    try:
        result = collide(scene, tolerance=tolerance)
    except ChaincorError as error:
        return row | {"verdict": "run refused", "reason": f"{type(error).__name__}: {error}"}
    row |= {
        "seconds": time.perf_counter() - started,
        "ending": result.ending,
        "restitution": result.restitution,
        "restitution_error": result.restitution_error,
        "contacts": result.contacts,
        "last_contact_time": result.last_contact_time,
        "duration": result.duration,
    }
    started = time.perf_counter()
    try:
        judged = judge_collision(
            law_of(scene), scene.particles, scene.impact_velocity,
            multiple=multiple, accuracy=accuracy,
        )  # fmt: skip
    except JudgeRefusal as error:
        # A late contact may depend on the last digit; that there is one more does not.
        few = bool(error.contacts) and result.contacts < min(error.contacts)
        row |= {"judge_contacts": min(error.contacts, default=None), "reason": str(error)}
        return row | {"verdict": "contacts" if few else "judge refused"}
    difference = abs(result.restitution - judged.restitution)
    row |= {
        "judge_seconds": time.perf_counter() - started,
        "judge_restitution": judged.restitution,
        "judge_error": judged.restitution_error,
        "judge_contacts": judged.contacts,
        "judge_last_contact_time": judged.last_contact_time,
        "judge_horizon": judged.horizon,
        "judge_first_piece": judged.first_piece.particles,
        "judge_first_velocity": judged.first_piece.velocity,
        "contacts_after_end": int(np.sum(judged.contact_times > result.duration)),
        "difference": difference,
    }
    bar = result.restitution_error or 0.0
    if result.contacts != judged.contacts:
        return row | {"verdict": "contacts"}
    # The judge's error is a difference of two runs: allow for it being small by luck.
    wrong = difference > bar + 10.0 * judged.restitution_error + 1e-14
    return row | {"verdict": "bar" if wrong else "agrees"}


def read_rows(file: Path, settings: Row) -> dict[int, Row]:
    """Return what a file holds, by index; a last line that was cut off is dropped from it."""
    if not file.exists():
        return {}
    text = file.read_text()
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        file.write_text(whole)
    rows = [json.loads(line) for line in whole.splitlines()]
    for row in rows:
        other = {key: row[key] for key in settings if row[key] != settings[key]}
        if other:
            raise SystemExit(f"{file} was made with {other}, asked are {settings}: give another -o")
    return {row["index"]: row for row in rows}


def report(rows: list[Row]) -> bool:
    """Print the figures; return whether no number is wrong that was not called open."""
    print(f"scenes: {len(rows)}")
    table = Counter((row["verdict"], row.get("ending", "-")) for row in rows)
    for (verdict, ending), count in sorted(table.items()):
        print(f"  {verdict:14} ending {ending:10} {count}")
    wrong = [row for row in rows if row["verdict"] in ("contacts", "bar")]
    for row in sorted(wrong, key=lambda row: -row.get("difference", 1.0)):
        line = (
            f"  {row['verdict']:8} {row['potential']} n={row['particles']} speed={row['speed']:.6f}"
            f" {row['ending']}: {row['contacts']} contacts, {row['restitution']:.9f} +- "
            f"{row['restitution_error'] or 0.0:.1e}, last at {row['last_contact_time']:.2f}, end "
            f"at {row['duration']:.2f}; judge {row['judge_contacts']}"
        )
        if "difference" in row:
            line += f", {row['judge_restitution']:.9f} +- {row['judge_error']:.0e}, last at "
            line += f"{row['judge_last_contact_time']:.2f}"
        print(line)
    refused = Counter(
        (row["verdict"], row["potential"], row["reason"].split(":")[0][:60])
        for row in rows
        if row["verdict"].endswith("refused")
    )
    for (verdict, potential, reason), count in refused.most_common():
        print(f"  {verdict}: {potential}: {reason} ({count})")
    judged = [row for row in rows if not row["verdict"].endswith("refused")]
    timed = [row for row in judged if "judge_seconds" in row]
    if timed:
        ratio = sum(r["judge_seconds"] for r in timed) / sum(r["seconds"] for r in timed)
        print(f"the judge took {ratio:.1f} times the time of the runs")
    silent = [row for row in wrong if row["ending"] != "open"]
    print(f"not confirmed: {len(wrong)} of {len(judged)}, not called open: {len(silent)}")
    return not silent


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--count", type=int, default=3500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--tolerance", type=float, default=1e-8)
    parser.add_argument("--engine", choices=["lammps", "reference"], default="reference")
    parser.add_argument("--multiple", type=float, default=20.0, help="of the last contact's time")
    given = parser.parse_args()
    settings = {name: getattr(given, name) for name in ("seed", "tolerance", "multiple", "engine")}
    rows = read_rows(given.output, settings)
    missing = [index for index in range(given.count) if index not in rows]
    context = multiprocessing.get_context("spawn")
    with context.Pool(given.processes) as pool, given.output.open("a") as file:
        for row in pool.imap_unordered(partial(try_scene, **settings), missing):
            rows[row["index"]] = row
            file.write(json.dumps(row) + "\n")
            file.flush()
    asked = [row for index, row in sorted(rows.items()) if index < given.count]
    raise SystemExit(0 if report(asked) else 1)


if __name__ == "__main__":
    main()
