"""
Judge many scenes by small fixed steps of another scheme, far beyond the last contact.

    python -m tests.judge.plain -o FILE [--count 3500] [--seed 1] [--processes 1]
        [--draw late|breaking|loose|together|long|forgetful] [--tolerance 1e-6]
        [--engine reference|lammps]

The state is particle 1's distance from the wall, the strains and the velocities. Steps are Blanes
and Moan's composition of order 4 for Hamiltonians that are quadratic in the momenta (2002).
Particle 1 has hit the wall if a step ends behind the wall, or if the particle turns near it within
the step. Secants then shorten the step until it ends at the wall. Two runs with incommensurate
steps must agree in their contacts, if necessary with smaller steps; otherwise the judge is unsure.
In long chains, the last digits of the speed may decide the contacts. Then all runs at speeds that
differ in the last digits must lie within the error bar. The judge shares no code with the engines,
nor with ``judge.py``, which is far more exact and far slower.
"""

import argparse
import json
import math
import multiprocessing
import sys
import time
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from benchmarks.scenes.batches import collide_in_batch, draw_together
from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.result import Collision
from tests.judge.late_scenes import (
    draw_breaking,
    draw_forgetful,
    draw_late,
    draw_long,
    draw_loose,
)

# The coefficients are from J. Comput. Appl. Math. 142 (2002) 313: 7 kicks b and 6 drifts a, both
# palindromic.
_B = (0.0829844064174052, 0.396309801498368, -0.0390563049223486)
_A = (0.245298957184271, 0.604872665711080)
KICKS = np.array([*_B, 1.0 - 2.0 * sum(_B), *_B[::-1]])
DRIFTS = np.array([*_A, 0.5 - sum(_A), 0.5 - sum(_A), *_A[::-1]])
# Steps are in units of the stiffest bond's 1/frequency. If the two runs disagree, or if the result
# is outside its error bar, both runs are repeated with these fractions of the steps.
STEPS = (0.06, 0.043)
CLOSER = (1.0, 1.0 / 3.0, 1.0 / 9.0)
# The judge runs up to this multiple of the time of the last contact. The multiple is smaller if the
# end is called open, because a later contact would then be no error.
MULTIPLE, MULTIPLE_OPEN = 20.0, 3.0
# Long chains take minutes, so the judge follows them for a shorter time. Its error must be below
# this fraction of their error bars.
MULTIPLE_LONG, SHARP_LONG = 1.5, 0.3
SHARP = 1e-4
# If the last digits decide the contacts, the judge uses this multiple, and speeds that differ by
# these numbers of units in the last digit.
MULTIPLE_FORGETFUL = 1.05
NUDGES = (-4.0, 0.0, 1.0, 3.0)
LJ, TODA, LOG, POWER, HARMONIC = range(5)
KINDS = {"lj": LJ, "toda": TODA, "log": LOG, "power": POWER, "harmonic": HARMONIC}


@njit(error_model="numpy", cache=True)
def _kick(s, v, h, kind, b, c, order, pull):
    bonds = s.shape[0]
    if kind == LJ:
        for i in range(bonds):
            y = 1.0 / (1.0 + s[i])
            y2 = y * y
            y6 = y2 * y2 * y2
            pull[i] = h * y6 * y * (y6 - 1.0) / 6.0
    elif kind == TODA:
        for i in range(bonds):
            pull[i] = h * math.expm1(-b * s[i]) / b
    elif kind == LOG:
        for i in range(bonds):
            pull[i] = -h * s[i] / (1.0 + s[i])
    elif kind == POWER:
        for i in range(bonds):
            p = 1.0
            for _ in range(order - 1):
                p *= s[i]
            pull[i] = -h * (s[i] + order * c * p)
    else:
        for i in range(bonds):
            pull[i] = -h * s[i]
    v[0] -= pull[0]
    for i in range(1, bonds):
        v[i] += pull[i - 1] - pull[i]
    v[bonds] += pull[bonds - 1]


@njit(error_model="numpy", cache=True)
def _step(x, s, v, h, kicks, drifts, kind, b, c, order, pull):
    for k in range(drifts.shape[0]):
        _kick(s, v, kicks[k] * h, kind, b, c, order, pull)
        d = drifts[k] * h
        x += d * v[0]
        for i in range(s.shape[0]):
            s[i] += d * (v[i + 1] - v[i])
    _kick(s, v, kicks[drifts.shape[0]] * h, kind, b, c, order, pull)
    return x


@njit(error_model="numpy", cache=True)
def _run(n, v0, h, least, multiple, kicks, drifts, kind, b, c, order, times):
    s = np.zeros(n - 1)
    v = np.full(n, -v0)
    v[0] = v0
    x, now, hits = 0.0, 0.0, 1
    times[0] = 0.0
    s1, v1, pull = s.copy(), v.copy(), s.copy()
    left = h
    while now < max(least, multiple * times[hits - 1]):
        s1[:] = s
        v1[:] = v
        x1 = x
        x = _step(x1, s, v, left, kicks, drifts, kind, b, c, order, pull)
        hit = x < 0.0
        if (
            not hit
            and v1[0] < 0.0
            and v[0] > 0.0
            and x1 + 0.5 * v1[0] * left < 0.0
            and left > h / 64
        ):
            # The particle turned near the wall, so the search uses shorter steps.
            s[:] = s1
            v[:] = v1
            x = x1
            left *= 0.25
            continue
        if hit:
            low, high, t = 0.0, left, left * x1 / (x1 - x) if x1 > 0.0 else 0.5 * left
            for _ in range(60):
                s[:] = s1
                v[:] = v1
                x = _step(x1, s, v, t, kicks, drifts, kind, b, c, order, pull)
                if x > 0.0:
                    low = t
                else:
                    high = t
                if abs(x) < 1e-15 and v[0] < 0.0:
                    break
                better = t - x / v[0] if v[0] < 0.0 else 0.5 * (low + high)
                t = better if low < better < high else 0.5 * (low + high)
            now += t
            x = 0.0
            v[0] = abs(v[0])
            if hits == times.shape[0]:
                return hits, s, v, x, now
            times[hits] = now
            hits += 1
            left = h
            continue
        now += left
        left = h
    return hits, s, v, x, now


def run_on(scene: Scene, step: float, least: float, multiple: float = MULTIPLE) -> dict[str, Any]:
    """Run a scene with named bonds far beyond its last contact."""
    n, v0 = scene.particles, scene.impact_velocity
    times = np.zeros(4 * n + 64)
    hits, _, v, x, now = _run(
        n, v0, step, least, multiple, KICKS, DRIFTS, KINDS[scene.potential],
        float(scene.toda_b or 10.0), float(scene.power_c or 0.0), int(scene.power_order or 3),
        times,
    )  # fmt: skip
    eta = (float(np.mean(v)) / v0) ** 2
    return {
        "contacts": int(hits),
        "eta": eta,
        "last": float(times[hits - 1]),
        "horizon": now,
        "x": x,
    }


def stiffest(scene: Scene, bond_min: float) -> float:
    """Return the frequency of the shortest bond, from the force laws."""
    s = bond_min - 1.0
    curvature = {
        "lj": lambda: (13.0 * bond_min**-14.0 - 7.0 * bond_min**-8.0) / 6.0,
        "toda": lambda: math.exp(-(scene.toda_b or 10.0) * s),
        "log": lambda: bond_min**-2.0,
        "harmonic": lambda: 1.0,
        "power": lambda: (
            1.0
            + scene.power_order
            * (scene.power_order - 1)
            * scene.power_c
            * s ** (scene.power_order - 2)
        ),
    }[scene.potential]()
    return math.sqrt(max(1.0, curvature))


DRAWS = {
    "late": draw_late,
    "breaking": draw_breaking,
    "loose": draw_loose,
    "together": draw_together,
    "long": draw_long,
    "forgetful": draw_forgetful,
}


def try_scene(index: int, *, seed: int, draw: str, tolerance: float, engine: str) -> dict[str, Any]:
    """Run one scene and judge it."""
    scene = DRAWS[draw](seed, index, engine)
    row: dict[str, Any] = {
        "index": index,
        "potential": scene.potential,
        "particles": scene.particles,
        "speed": scene.speed,
        "velocity": scene.impact_velocity,
        "scheme": scene.scheme,
        "timestep": scene.timestep,
        "asked": scene.tolerance,
    }
    begun = time.process_time()
    try:
        if draw == "together":
            found, row["together"] = collide_in_batch(scene)
        elif scene.explicit or scene.tolerance is not None:
            found = collide(scene)
        else:
            found = collide(scene, tolerance=tolerance)
    except ChaincorError as error:
        return row | {"verdict": "refused", "reason": f"{type(error).__name__}: {error}"[:200]}
    row |= {
        "seconds": time.process_time() - begun,
        "ending": found.ending,
        "eta": found.restitution,
        "bar": found.restitution_error,
        "contacts": found.contacts,
        "last": found.last_contact_time,
        "duration": found.duration,
        "tolerance_met": found.tolerance_met,
    }
    begun = time.process_time()
    multiple = MULTIPLE_OPEN if found.ending == "open" else MULTIPLE
    least = multiple * found.last_contact_time + 5.0 * (scene.particles + 5.0)
    sharp = SHARP
    if draw == "long":
        multiple = MULTIPLE_LONG
        least, sharp = multiple * found.last_contact_time, SHARP_LONG * found.restitution_error
    if draw == "forgetful":
        return row | _judge_by_nudges(scene, found, begun)
    frequency = stiffest(scene, found.bond_min)
    for closer in CLOSER:
        coarse, fine = (run_on(scene, closer * step / frequency, least, multiple) for step in STEPS)
        uncertain = abs(coarse["eta"] - fine["eta"]) / ((STEPS[0] / STEPS[1]) ** 4 - 1.0)
        off = abs(found.restitution - fine["eta"])
        if coarse["contacts"] != fine["contacts"] or not uncertain <= sharp:
            verdict = "judge unsure"
        elif off > found.restitution_error + 3.0 * uncertain + 1e-12:
            verdict = "outside"
        else:
            same = found.contacts == fine["contacts"]
            verdict = "inside" if same else "contacts differ, bar holds"
            break
    row |= {"judge": fine, "judge_error": uncertain, "judge_seconds": time.process_time() - begun}
    return row | {"verdict": verdict}


def _judge_by_nudges(scene: Scene, found: Collision, begun: float) -> dict[str, Any]:
    """Return the verdict of runs at speeds that differ in their last digits."""
    if found.tolerance_met:
        return {"verdict": "met, not judged"}  # `--draw long` judges these scenes
    step = CLOSER[1] * STEPS[0] / stiffest(scene, found.bond_min)
    least = MULTIPLE_FORGETFUL * found.last_contact_time
    runs = []
    for ulps in NUDGES:
        speed = (1.0 + ulps * sys.float_info.epsilon) * scene.impact_velocity
        nudged = scene.replace(speed=None, velocity=speed)
        runs.append(run_on(nudged, step, least, MULTIPLE_FORGETFUL))
    worst = max(runs, key=lambda run: abs(run["eta"] - found.restitution))
    etas = [run["eta"] for run in runs]
    off = abs(worst["eta"] - found.restitution)
    return {
        "judge": worst,
        "judge_error": max(etas) - min(etas),
        "judge_seconds": time.process_time() - begun,
        "verdict": "inside" if off <= found.restitution_error + 1e-12 else "outside",
    }


def report(rows: list[dict[str, Any]]) -> None:
    """Print the counts and the largest errors."""
    print(f"scenes: {len(rows)}")
    if together := sum(row.get("together", False) for row in rows):
        inside = sum(row.get("together", False) and row["verdict"] == "inside" for row in rows)
        print(f"  carried out together with others: {together}, of which inside {inside}")
    for (verdict, ending), count in sorted(
        Counter((row["verdict"], row.get("ending", "-")) for row in rows).items()
    ):
        print(f"  {verdict:28} ending {ending:8} {count}")
    for row in rows:
        if row["verdict"] in ("outside", "contacts differ, bar holds"):
            judge = row["judge"]
            print(
                f"  {row['verdict']}: {row['potential']} n={row['particles']} "
                f"v0={row['velocity']!r} {row['ending']}: {row['contacts']} contacts, "
                f"{row['eta']:.9f} +- {row['bar']:.1e}, last {row['last']:.1f}; judge "
                f"{judge['contacts']}, {judge['eta']:.9f} +- {row['judge_error']:.0e}, last "
                f"{judge['last']:.1f} ({row['index']})"
            )


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--count", type=int, default=3500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--draw", choices=sorted(DRAWS), default="late")
    parser.add_argument("--tolerance", type=float, default=1e-6)
    parser.add_argument("--engine", choices=["lammps", "reference"], default="reference")
    parser.add_argument("--processes", type=int, default=1)
    given = parser.parse_args()
    rows: dict[int, dict[str, Any]] = {}
    if given.output.exists():
        rows = {r["index"]: r for r in map(json.loads, given.output.read_text().splitlines())}
    missing = [index for index in range(given.count) if index not in rows]
    settings = {name: getattr(given, name) for name in ("seed", "draw", "tolerance", "engine")}
    pool = multiprocessing.get_context("spawn").Pool(given.processes)
    with pool, given.output.open("a") as file:
        for row in pool.imap_unordered(partial(try_scene, **settings), missing):
            rows[row["index"]] = row
            file.write(json.dumps(row) + "\n")
            file.flush()
    report([row for _, row in sorted(rows.items())])


if __name__ == "__main__":
    main()
