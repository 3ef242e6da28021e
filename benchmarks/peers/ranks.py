"""
LAMMPS on one rank and on two: the time of a step of a scripted job, for long chains.

    python -m benchmarks.peers.ranks [--particles 20000 100000] [--ranks 1 2] [--repeats 3]

The job is what ``chaincor inputs`` writes, with the chain made longer and stopped after some steps;
what reading costs is taken off by a job of few steps. As written, its box is cut in the middle,
left of which there is no chain: with ``balance`` behind it, each rank gets as many particles. Ranks
that wait keep their core busy: on a machine with other work to do two ranks take far longer.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from chaincor.lammps_inputs.chain_data import format_data
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.job import write_job

STEPS, FEW = 400, 20
TIMESTEP = 0.01
BALANCE = "balance 1.0 shift x 20 1.001"


def write(folder: Path, particles: int) -> str:
    """Write the files of a chain of so many particles, and return its script."""
    short = Scene(speed=0.4, scheme="verlet", timestep=TIMESTEP, error=False)
    write_job(short, folder)
    (folder / "chain.data").write_text(format_data(short.replace(particles=particles).line))
    return (folder / "in.chain").read_text()


def seconds(folder: Path, script: str, steps: int, ranks: int, repeats: int) -> float:
    """Return the least seconds of a job of so many steps."""
    script = re.sub(r"\$\(ceil\(\S+?/v_step\)\)", str(steps), script)
    script = re.sub(r"(\$\(time\)) > \S+", rf'\1 > {0.9 * steps * TIMESTEP:g}"', script)
    (folder / "in.timed").write_text(script)
    bin_folder = Path(sys.executable).parent
    library = str(bin_folder.parent / "lib")
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "LD_LIBRARY_PATH": library}
    command = [str(bin_folder / "mpiexec"), "-n", str(ranks), str(bin_folder / "lmp")]
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        found = subprocess.run(
            [*command, "-in", "in.timed", "-log", "none"],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        times.append(time.perf_counter() - started)
        assert "UNFINISHED" in found.stdout, found.stdout[-600:] + found.stderr[-600:]
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("--particles", type=int, nargs="+", default=[20_000, 100_000])
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    print("| n | ranks | balanced | us a step |\n|---|---|---|---|")
    for particles in arguments.particles:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            plain = write(folder, particles)
            balanced = re.sub(r"(?m)^(run +0 post no)", rf"{BALANCE}\n\1", plain)
            for ranks in arguments.ranks:
                for script in (plain, balanced)[:ranks]:
                    many, few = (
                        seconds(folder, script, steps, ranks, arguments.repeats)
                        for steps in (STEPS, FEW)
                    )
                    step = (many - few) / (STEPS - FEW) * 1e6
                    word = "yes" if script is balanced else "no"
                    print(f"| {particles} | {ranks} | {word} | {step:.0f} |", flush=True)


if __name__ == "__main__":
    main()
