"""
Test the error bars of ``chaincor analyze``, with random jobs that LAMMPS runs at two steps.

    python -m benchmarks.bars.analyzed [--pairs 30] [--seed 1] [--csv FILE]

Two jobs of each collision are written by ``chaincor inputs --frames``, run by ``lmp -in`` and
analysed by ``chaincor analyze``. The true eta comes from the reference engine at 1e-10. The study
prints how often the true eta is within `restitution_error`, if this is not null, and how often the
eta that the job itself printed is within `data_error`. It also prints quantiles of the ratio of the
true error to the larger of difference and drift. The reserves in ``chaincor.analysis.step_error``
must exceed the largest ratio. Finally, it prints why error bars are null.
"""

import argparse
import csv
import json
import math
import re
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

from chaincor.analysis.step_error import EVENT_RESERVE, REFLECT_RESERVE
from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.lammps.library import find_lmp_command, lmp_environment

_POTENTIALS = ("harmonic", "lj", "toda", "log")
_REFERENCE = 1e-10


@dataclass(frozen=True)
class Pair:
    """Two jobs of one collision: result of the analysis, printed result, and true result."""

    potential: str
    particles: int
    velocity: float
    wall: str
    step: float
    ratio: float
    restitution: float
    restitution_error: float | None
    data_error: float
    printed: float
    reference_value: float
    exit_status: int
    why_null: str

    @property
    def error(self) -> float:
        """True error of the analysed eta."""
        return abs(self.restitution - self.reference_value)

    @property
    def is_honest(self) -> bool:
        """Whether the true eta, within the tolerance of the reference, is within the error bar."""
        return self.restitution_error is None or self.error <= self.restitution_error + _REFERENCE

    @property
    def is_read(self) -> bool:
        """Whether the analysed eta agrees with the eta that the job printed."""
        return abs(self.restitution - self.printed) <= self.data_error


def random_scene(random: np.random.Generator) -> tuple[Scene, float]:
    """Draw a scene at the finer of two time steps, and the ratio of the time steps."""
    potential = str(random.choice(_POTENTIALS))
    speed = {"velocity": 10 ** random.uniform(-2, -0.4)}
    if potential != "harmonic":
        speed = {"speed": 10 ** random.uniform(-1.5, 0)}
    ratio = float(random.choice([1.5, 2.0, 3.0]))
    scene = Scene(
        potential=potential,
        particles=round(10 ** random.uniform(math.log10(2), 2)),
        wall=str(random.choice(["event", "reflect"])),
        scheme="verlet",
        timestep=10 ** random.uniform(-2.5, -1.3) / ratio,
        error=False,  # otherwise the logs of the jobs would contain the error
        **{key: float(value) for key, value in speed.items()},
    )
    return scene, ratio


def try_pair(scene: Scene, ratio: float, folder: Path) -> Pair:
    """Write, run and analyse a collision at two time steps."""
    assert scene.timestep is not None
    coarse = scene.replace(timestep=ratio * scene.timestep)
    printed = [_run(one, folder / name) for name, one in (("coarse", coarse), ("fine", scene))][1]
    status, out = _chaincor("analyze", folder, "--json")
    result = json.loads(out)
    numerics = dict.fromkeys(("wall", "scheme", "timestep"))
    exact = scene.replace(**numerics, error=True, engine="reference")
    reference_value = collide(exact, tolerance=_REFERENCE)
    null = [caveat for caveat in result["caveats"] if "restitution_error is not known" in caveat]
    return Pair(
        potential=scene.label,
        particles=scene.particles,
        velocity=scene.impact_velocity,
        wall=scene.wall or "event",
        step=scene.timestep,
        ratio=ratio,
        restitution=result["restitution"],
        restitution_error=result["restitution_error"],
        data_error=result["data_error"],
        printed=printed,
        reference_value=reference_value.restitution,
        exit_status=status,
        why_null=null[0].split(";")[0].split(": ")[1] if null else "",
    )


def _run(scene: Scene, folder: Path) -> float:
    folder.mkdir()
    path = folder / "scene.toml"
    path.write_text(scene.to_toml())
    _chaincor("inputs", path, "--frames", "--force", "-o", folder)
    command = [find_lmp_command() or "lmp", "-in", "in.chain"]
    environment = lmp_environment()
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    found = re.search(r"^restitution = (\S+)", done.stdout, re.MULTILINE)
    if found is None:
        last = [line for line in done.stdout.splitlines() if "ERROR" in line or "UNFIN" in line]
        raise RuntimeError(last[-1] if last else f"exit status {done.returncode}")
    return float(found[1])


def _chaincor(*arguments: object) -> tuple[int, str]:
    code = "from chaincor.workflows.cli import main; main()"
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True)
    if not done.stdout:
        raise RuntimeError(done.stderr.strip())
    return done.returncode, done.stdout


def summarise(pairs: list[Pair]) -> str:
    """Return fractions and quantiles for each wall."""
    read = sum(pair.is_read for pair in pairs)
    lines = [f"the job's own number within data_error: {read} of {len(pairs)}"]
    for wall, reserve in (("event", EVENT_RESERVE), ("reflect", REFLECT_RESERVE)):
        chosen = [pair for pair in pairs if pair.wall == wall and pair.restitution_error]
        honest = sum(pair.is_honest for pair in chosen)
        lines.append(f"{wall}: truth within restitution_error: {honest} of {len(chosen)}")
        if chosen:
            used = [reserve * pair.error / (pair.restitution_error or 1.0) for pair in chosen]
            found = ", ".join(f"{q:.3g}" for q in np.quantile(used, [0.5, 0.9, 0.99, 1.0]))
            lines.append(f"  error over what difference and drift say: {found} (50, 90, 99, 100 %)")
    nulls = Counter(pair.why_null for pair in pairs if pair.restitution_error is None)
    lines += [f"null, {count} times: {why}" for why, count in nulls.items()]
    statuses = Counter(pair.exit_status for pair in pairs)
    return "\n".join([*lines, f"exit statuses: {dict(statuses)}"])


def main() -> None:
    """Draw pairs, run them, and print the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--csv", type=Path)
    options = parser.parse_args()
    random = np.random.default_rng(options.seed)
    pairs, refused = [], []
    for _ in range(options.pairs):
        scene, ratio = random_scene(random)
        with tempfile.TemporaryDirectory() as folder:
            try:
                pairs.append(try_pair(scene, ratio, Path(folder)))
            except (ChaincorError, RuntimeError) as error:
                refused.append(str(error))
    print(summarise(pairs))
    for reason in refused:
        print(f"refused: {reason[:150]}")
    if options.csv:
        with options.csv.open("w", newline="") as file:
            writer = csv.DictWriter(file, [field.name for field in fields(Pair)])
            writer.writeheader()
            writer.writerows(asdict(pair) for pair in pairs)


if __name__ == "__main__":
    main()
