"""
Test error bars in random scenes, against much more accurate runs.

    python -m benchmarks.bars.honest [--scenes 300] [--seed 1] [--workers 2] [--engine NAME]
        [--kind named|user|formula|batch] [--csv FILE]

Scenes with bonds of users (with kinks, without tension, smooth, or tables with few digits), morse
bonds and formulas are judged by an integrator that shares no code with the engines
(``judge.kinks``).

Prints how often the true error is within the reported error, and each refusal with its reason. For
scenes whose reported error meets the tolerance, it also prints how often the true error is within
the tolerance, and the median ratio of reported error to tolerance.
"""

import argparse
import csv
import multiprocessing
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.bars.formula_scenes import FormulaCase, random_formula
from benchmarks.bars.user_scenes import UserCase, random_case
from benchmarks.scenes.batches import collide_in_batch, draw_together
from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.result import Collision

_POTENTIALS = ("harmonic", "lj", "toda", "log", "power")
# Tolerance of the judge as a fraction of the reported error, and the smallest tolerance that
# rounding allows.
_JUDGE_SHARE = 0.01
_SHARPEST_JUDGE = 1e-13


@dataclass(frozen=True)
class Trial:
    """A random scene with the tolerance, the reported error and the true error."""

    potential: str
    particles: int
    velocity: float
    speed: float | None
    engine: str
    scheme: str
    tolerance: float
    reported: float | None
    true: float | None
    judge_error: float | None
    met: bool
    seconds: float
    refusal: str | None


def random_scene(random: np.random.Generator, engine: str | None = None) -> Scene:
    """Draw a scene: potential, size, speed, tolerance, and engine unless it is given."""
    potential = str(random.choice(_POTENTIALS))
    fields = {
        "potential": potential,
        "particles": round(10 ** random.uniform(np.log10(2), np.log10(300))),
        "engine": str(random.choice(["lammps", "reference"])),
        "tolerance": float(10 ** random.uniform(-9, -3)),
    }
    if potential == "harmonic":
        fields["velocity"] = float(10 ** random.uniform(-5, np.log10(0.6)))
    else:
        fields["speed"] = float(10 ** random.uniform(-4, 1))
    if potential == "toda":
        fields["toda_b"] = float(random.choice([1.0, 10.0, 100.0]))
    if potential == "power":
        order = int(random.integers(3, 8))
        fields |= {"power_order": order, "power_c": 1.0 if order % 2 == 0 else -1.0}
    return Scene(**fields | ({} if engine is None else {"engine": engine}))


def try_scene(scene: Scene) -> Trial:
    """Run a scene and judge it by the reference engine at a much tighter tolerance."""

    def judged(bar):
        share = max(_JUDGE_SHARE * bar, _SHARPEST_JUDGE)
        judge = collide(scene.replace(engine="reference", tolerance=share))
        return judge.restitution, judge.restitution_error

    return _try(scene, judged)


def draw_batch(random: np.random.Generator, _engine: str | None = None) -> Scene:
    """Draw a scene that may run in a batch."""
    seed, index = (int(number) for number in random.integers(0, 2**31, 2))
    return draw_together(seed, index, "reference")


def try_in_batch(scene: Scene) -> Trial:
    """Try a scene like `try_scene`, but in a batch; `seconds` is 0 if it could only run alone."""

    def judged(bar):
        share = max(_JUDGE_SHARE * bar, _SHARPEST_JUDGE)
        judge = collide(scene.replace(tolerance=share))
        return judge.restitution, judge.restitution_error

    together = False

    def carried_out(asked: Scene) -> Collision:
        nonlocal together
        result, together = collide_in_batch(asked)
        return result

    trial = _try(scene, judged, carried_out)
    return trial if together else replace(trial, seconds=0.0)


def try_case(case: UserCase | FormulaCase) -> Trial:
    """Run a scene with a user's bond or a formula and judge it by another integrator."""
    with tempfile.TemporaryDirectory() as folder:
        return _try(case.scene(Path(folder)), lambda _bar: case.reference_value(Path(folder)))


def _try(
    scene: Scene,
    judged: Callable[[float], tuple[float, float]],
    carried_out: Callable[[Scene], Collision] = collide,
) -> Trial:
    common = {
        "potential": scene.label,
        "particles": scene.particles,
        "velocity": scene.impact_velocity,
        "speed": scene.speed,
        "engine": scene.engine,
        "tolerance": scene.tolerance,
    }
    nothing = {"scheme": "", "reported": None, "true": None, "judge_error": None, "met": False}
    try:
        result = carried_out(scene)
    except ChaincorError as error:
        reason = f"{type(error).__name__}: {error}"
        return Trial(**common, **nothing, seconds=0.0, refusal=reason)
    try:
        reference_value, judge_error = judged(result.restitution_error)
    except ChaincorError as error:
        reason = f"judge: {type(error).__name__}: {error}"
        return Trial(**common, **nothing, seconds=result.seconds_total, refusal=reason)
    return Trial(
        **common,
        scheme=result.scheme,
        reported=result.restitution_error,
        true=abs(result.restitution - reference_value),
        judge_error=judge_error,
        met=bool(result.tolerance_met),
        seconds=result.seconds_total,
        refusal=None if result.tolerance_met else result.reason,
    )


def report(trials: list[Trial], kind: str = "named") -> bool:
    """Print the results; return whether they are good."""
    claimed = [t for t in trials if t.met]
    answered = [t for t in trials if t.reported is not None]
    honest = [t for t in answered if t.true <= t.reported + t.judge_error]
    within = [t for t in claimed if t.true <= t.tolerance]
    exact = ("modal", "hard-sphere")
    stepped = [t.reported / t.tolerance for t in claimed if t.scheme not in exact]
    print(f"scenes: {len(trials)}, answered: {len(answered)}, tolerance claimed: {len(claimed)}")
    print(f"true error within the reported one: {len(honest)}/{len(answered)}")
    print(f"true error within the tolerance, of those that claim it: {len(within)}/{len(claimed)}")
    print(f"median of reported error / tolerance: {np.median(stepped):.3g}")
    worst = sorted(answered, key=lambda t: -(t.true / t.reported))[:8]
    print("largest true/reported:")
    for t in worst:
        print(
            f"  {t.true / t.reported:8.2g}  {t.engine} {t.potential} n={t.particles} "
            f"speed={t.speed} v0={t.velocity:.3g} tol={t.tolerance:.1g} {t.scheme} "
            f"reported={t.reported:.1e} true={t.true:.1e} judge={t.judge_error:.0e}"
        )
    if kind == "batch":
        together = sum(t.seconds > 0.0 for t in trials)
        print(f"carried out together with others: {together}")
    refused = [t for t in trials if t.refusal]
    print(f"refusals and tolerances not met: {len(refused)}")
    for t in refused:
        print(
            f"  {t.engine} {t.potential} n={t.particles} speed={t.speed} v0={t.velocity:.2g} "
            f"tol={t.tolerance:.1g}: {t.refusal}"
        )
    slowest = sorted(trials, key=lambda t: -t.seconds)[:5]
    print("slowest: " + ", ".join(f"{t.engine} {t.potential} {t.seconds:.1f} s" for t in slowest))
    return (
        len(honest) >= 0.99 * len(answered)
        and len(within) >= 0.99 * len(claimed)
        and bool(np.median(stepped) >= 0.01)
    )


_KINDS: dict[str, tuple[Callable, Callable]] = {
    "named": (random_scene, try_scene),
    "user": (random_case, try_case),
    "formula": (random_formula, try_case),
    "batch": (draw_batch, try_in_batch),
}


def run_study(
    scenes: int, seed: int, workers: int, engine: str | None = None, kind: str = "named"
) -> list[Trial]:
    """Draw scenes, and try them in worker processes."""
    random = np.random.default_rng(seed)
    draw, attempt = _KINDS[kind]
    drawn = [draw(random, engine) for _ in range(scenes)]
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        return list(pool.imap(attempt, drawn))


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--engine", choices=["lammps", "reference"], help="one engine only")
    parser.add_argument(
        "--kind", choices=list(_KINDS), default="named", help="of bonds, or of a batch"
    )
    parser.add_argument("--csv", type=Path)
    arguments = parser.parse_args()
    trials = run_study(
        arguments.scenes, arguments.seed, arguments.workers, arguments.engine, arguments.kind
    )
    if arguments.csv:
        with arguments.csv.open("w", newline="") as file:
            writer = csv.DictWriter(file, fieldnames=list(asdict(trials[0])))
            writer.writeheader()
            writer.writerows(asdict(t) for t in trials)
    raise SystemExit(0 if report(trials, arguments.kind) else 1)


if __name__ == "__main__":
    main()
