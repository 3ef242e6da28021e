"""
Commands and lines of the three sizes of a job, and what `lmp` alone makes of each.

``python -m benchmarks.job_sizes [--no-run] [SCENE ...]`` writes the plain script, the one with
Verlet steps and the one that is made for the default tolerance of each scene, and prints how many
commands and lines they have. Each is run by nothing but ``lmp -in in.chain``; beside its number
stand the error that it prints, and its distance from the reference engine at 1e-10.
"""

import argparse
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.jobs import processor_time
from chaincor import Scene, collide, write_job
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.own_templates.rules import commands_of
from chaincor.lammps_inputs.units.unit_system import UnitSystem
from chaincor.workflows.engines.lammps.library import find_lmp_command

SCENES: dict[str, tuple[Scene, dict[str, Any]]] = {
    "default": (Scene(), {}),
    "harmonic, n = 20": (Scene(potential="harmonic", particles=20), {}),
    "masses 1, 2": (Scene(particles=20, masses=(1.0, 2.0)), {}),
    "free target": (Scene(particles=20, target_particles=10), {}),
    "soft contact": (Scene(particles=20, contact="power", contact_stiffness=5.0), {}),
    "warm chain": (Scene(particles=20, temperature=1e-4, seed=1), {}),
    "units metal": (Scene(particles=20), {"units": UnitSystem(4.0, 40.0, 1.0, "metal")}),
}
SIZES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "plain": ({}, {"plain": True}),
    "Verlet": ({"wall": "event", "scheme": "verlet", "timestep": 0.0125}, {}),
    "default": ({}, {}),
}


def run(folder: Path, reference_value: float) -> str:
    """Run a job; return its number, its error and how far it is off, as cells of a table."""
    lmp = find_lmp_command() or "lmp"
    text, _ = processor_time([lmp, "-in", "in.chain"], folder)
    found = dict(re.findall(r"^(restitution|restitution_error) = (\S+)$", text, re.MULTILINE))
    eta, error = float(found["restitution"]), found.get("restitution_error", "-")
    return f"{eta:.9f} | {error} | {abs(eta - reference_value):.1e}"


def main() -> None:
    """Print a Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=list(SCENES), metavar="SCENE")
    parser.add_argument("--no-run", action="store_true")
    given = parser.parse_args()
    print("| scene | size | commands | lines | restitution | error given | off |")
    print("|---|---|---|---|---|---|---|")
    for name in given.scenes:
        scene, wishes = SCENES[name]
        reference_value = 0.0
        if not given.no_run:
            reference_value = collide(
                scene.replace(engine="reference"), tolerance=1e-10
            ).restitution
        for size, (numerics, more) in SIZES.items():
            folder = Path(tempfile.mkdtemp(prefix="job-"))
            try:
                write_job(scene.replace(**numerics), folder, **wishes, **more)
                text = (folder / "in.chain").read_text()
                cells = "- | - | -" if given.no_run else run(folder, reference_value)
                counted = f"{len(commands_of(text))} | {len(text.splitlines())}"
                print(f"| {name} | {size} | {counted} | {cells} |", flush=True)
            except SceneError as error:
                print(f"| {name} | {size} | none: {error} |", flush=True)
            finally:
                shutil.rmtree(folder)


if __name__ == "__main__":
    main()
