"""
Compare columns of beads with a short C++ program and with LAMMPS, at equal error.

    python -m benchmarks.beads.peers

Touching beads with Hertz contacts hit a wall with the same contact law. The error of each run is
its difference from the reference engine at a tolerance of 1e-10. The C++ program then runs at the
time step at which it has the same error, and the ratio of the two processor times is printed.
"""

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from benchmarks.beads.verlet import VerletColumn
from benchmarks.jobs import processor_time
from benchmarks.peers.integrators import timed
from chaincor import Scene, collide, write_job
from chaincor.analysis.dumps.printed import printed_numbers
from chaincor.workflows.engines.lammps.library import find_lmp_command

BEADS = (10, 100)
TOLERANCES = (1e-4, 1e-6, 1e-8)
STEPS = (0.02, 0.005)
TURNS = 3


def scene(beads: int, **changes: object) -> Scene:
    """Return a column at the speed 0.1, at which beads in LAMMPS touch only their neighbours."""
    return Scene(potential="hertz", particles=beads, velocity=0.1, **changes)  # type: ignore[arg-type]


def reference_runs(beads: int, right: float) -> Iterator[tuple[str, float, float]]:
    """Yield name, error of 1 - eta and processor time of runs in the reference engine."""
    for tolerance in TOLERANCES:
        asked = scene(beads, engine="reference", tolerance=tolerance)
        error = abs(1 - collide(asked).restitution - right)
        seconds = min(timed(partial(collide, asked)) for _ in range(TURNS))
        yield f"reference {tolerance:g}", error, seconds


def granular_runs(beads: int, right: float, folder: Path) -> Iterator[tuple[str, float, float]]:
    """Yield name, error of 1 - eta and processor time of runs by ``pair_style granular``."""
    for step in STEPS:
        job = folder / f"{beads}_{step}"
        write_job(scene(beads, timestep=step), job)
        script = (job / "in.chain").read_text().replace("index 1.0 0.5 0.54 0.93", "index 1.0")
        (job / "in.chain").write_text(script)
        # The time in which LAMMPS starts and reads files is subtracted.
        idle = script.replace("ceil(v_duration/v_step)", "0")
        (job / "in.idle").write_text(idle)
        seconds = min(_seconds(job, "in.chain") - _seconds(job, "in.idle") for _ in range(TURNS))
        printed = printed_numbers((job / "log.in.chain").read_text(), ["restitution"])
        yield f"LAMMPS {step:g}", abs(1 - printed["restitution"] - right), seconds


def _seconds(job: Path, script: str) -> float:
    lmp = find_lmp_command()
    assert lmp is not None, "LAMMPS is installed"
    command = [lmp, "-in", script, "-log", f"log.{script}", "-screen", "none"]
    return processor_time(command, job)[1]


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cpp = VerletColumn.compiled_in(folder)
        print("beads  run               error     seconds   C++       ratio")
        for beads in BEADS:
            exact = scene(beads, engine="reference", tolerance=1e-10)
            right = 1 - collide(exact).restitution
            base = 0.02
            base_error = abs(cpp.run(1.5, False, beads, base).loss - right)
            runs = list(reference_runs(beads, right))
            # With ten beads, the run takes less time than the start of LAMMPS.
            if beads >= 100:
                runs += granular_runs(beads, right, folder)
            for label, error, seconds in runs:
                step = base * (max(error, 1e-11) / base_error) ** 0.5
                peer = min(cpp.run(1.5, False, beads, step).seconds for _ in range(TURNS))
                line = f"{beads:5d}  {label:16s}  {error:.1e}   {seconds:.2e}  {peer:.2e}"
                print(line, f" {seconds / peer:.3g}", flush=True)


if __name__ == "__main__":
    main()
