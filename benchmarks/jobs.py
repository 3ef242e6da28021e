"""
Compare jobs of random scenes, run by `lmp` alone, with the reference engine and a run.

``python -m benchmarks.jobs [--scenes 20] [--seed 1] [--tolerance 1e-8]`` draws scenes and writes a
job for each. The job runs with only ``lmp -in in.chain``. The error of its restitution is printed
in units of the error bar that the job printed. The true restitution comes from the reference engine
at 1e-11, whose error is subtracted. Costs are the processor times of ``lmp``, and of ``chaincor
run`` with the same tolerance right afterwards.
"""

import argparse
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from chaincor import Scene, collide
from chaincor.workflows.engines.lammps.library import find_lmp_command, lmp_environment
from chaincor.workflows.job import write_job


def random_scene(random: np.random.Generator) -> dict[str, Any]:
    """Draw a bond, a length and a speed, and for every third scene other bodies."""
    potential = random.choice(["harmonic", "lj", "toda", "log", "power"])
    fields: dict[str, Any] = {
        "potential": str(potential),
        "particles": int(np.exp(random.uniform(np.log(2), np.log(100)))),
    }
    if potential == "harmonic":
        fields["velocity"] = float(random.uniform(0.01, 0.3))
    else:
        fields["speed"] = float(np.exp(random.uniform(np.log(0.02), np.log(1.0))))
    if potential == "power":
        fields |= {"power_order": 4, "power_c": 10.0}
    other = random.integers(9)
    if other == 0:
        fields["masses"] = (1.0, 2.0)
    elif other == 1:
        fields |= {"target_particles": int(random.integers(1, 20))}
    elif other == 2:
        fields |= {"contact": "power", "contact_stiffness": 5.0}
    return fields


def processor_time(command: list[str], folder: Path) -> Any:
    """Run a command; return its output and its processor time."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        command, cwd=folder, env=lmp_environment(), capture_output=True, text=True, check=False
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    if done.returncode != 0:
        raise RuntimeError(f"{command} failed: {done.stdout[-500:]} {done.stderr[-500:]}")
    return done.stdout, seconds


def main() -> None:
    """Print a line for each scene, and the worst result."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tolerance", type=float, default=1e-8)
    given = parser.parse_args()
    lmp = find_lmp_command() or "lmp"
    random = np.random.default_rng(given.seed)
    worst_error, ratios, met = 0.0, [], 0
    for k in range(given.scenes):
        fields = random_scene(random)
        scene = Scene(**fields, tolerance=given.tolerance)
        independent = collide(Scene(**fields, engine="reference", tolerance=1e-11))
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write_job(scene, folder / "job")
            text, cost = processor_time([lmp, "-in", "in.chain"], folder / "job")
            (folder / "scene.toml").write_text(scene.to_toml())
            run = [sys.executable, "-m", "chaincor", "run", "scene.toml"]
            _, run_cost = processor_time(run, folder)
        eta, error = (
            float(re.findall(rf"^{key} = (\S+)$", text, re.MULTILINE)[-1])
            for key in ("restitution", "restitution_error")
        )
        assert independent.restitution_error is not None
        off = max(abs(eta - independent.restitution) - independent.restitution_error, 0.0) / error
        worst_error = max(worst_error, off)
        ratios.append(cost / run_cost)
        met += error <= given.tolerance
        print(
            f"{k + 1:3d} off {off:6.3f} of the bar {error:.2e}  lmp {cost:6.2f} s, "
            f"run {run_cost:6.2f} s, ratio {cost / run_cost:5.2f}  {fields}",
            flush=True,
        )
    print(
        f"worst: {worst_error:.3f} of the printed bar; bars within {given.tolerance:g}: {met} of "
        f"{given.scenes}; cost of lmp over run: largest {max(ratios):.2f}, "
        f"median {np.median(ratios):.2f}"
    )


if __name__ == "__main__":
    main()
