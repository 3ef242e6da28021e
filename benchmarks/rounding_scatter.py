"""Compare rounding errors predicted by derivatives with the scatter at neighbouring speeds.

Runs with the same scheme and time step have impact speeds that are neighbouring doubles. The exact
eta changes by only about 1e-16 of its slope, but each run has other rounding errors. Late contacts
of a broken chain occur in some runs and not in others. Eta is therefore compared after the contacts
during the first four crossings of sound. Prints a row of docs/sensitivity.md for each scene. The
exit status is 1 if prediction and scatter differ by more than a factor of 3, which happens if
rounding decides whether a contact occurs (3000:0.39).

Run: python -m benchmarks.rounding_scatter [--runs 10] [PARTICLES:SPEED ...]
"""

import argparse
import sys
import time

import numpy as np

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.reference import stepping
from chaincor.workflows.sensitivity.sensitivity import first_linearised_step, gradient
from chaincor.workflows.sensitivity.trace import SCHEME, trace

SCENES = ("100:0.4", "100:1", "1000:1")
# Time step of a coarse run that gives shortest bond and contacts, and crossings of sound after
# which eta is compared.
SCOUT, CROSSINGS = 0.1, 4.0
# Largest ratio of scatter to prediction. The standard deviation of ten runs is known to a quarter,
# and rounding is not entirely random.
MOST = 3.0


def compare(particles: int, speed: float, runs: int) -> tuple[str, bool]:
    """Return a row of the table for an lj chain, and whether the scatter is as predicted."""
    began = time.process_time()
    scene = Scene(potential="lj", particles=particles, speed=speed, engine="reference")
    v0 = scene.impact_velocity
    scout = stepping.run(scene.problem, Numerics(scheme=SCHEME, timestep=SCOUT))
    step, until = first_linearised_step(scene, scout.bond_min - 1.0), CROSSINGS * particles
    contacts = int(np.sum(scout.contact_times < until))
    etas = []
    for k in range(-(runs // 2), runs - runs // 2):
        near = scene.without("speed").replace(velocity=v0 + k * float(np.spacing(v0)))
        *_, last = next(trace(near, step, contacts, until).backward())
        etas.append((near.line.separation(last) / near.impact_velocity) ** 2)
    found = gradient(trace(scene, step, contacts, until), [])
    size = np.hypot(np.linalg.norm(found.strains), np.linalg.norm(found.velocities))
    scatter = float(np.std(etas, ddof=1))
    ratio = scatter / found.rounding
    row = (
        f"| {particles} | {speed:g} | {found.restitution:.9f} | {contacts} | "
        f"{v0 * size / found.restitution:.2g} | {found.rounding:.1e} | {scatter:.1e} | "
        f"{ratio:.2f} | {time.process_time() - began:.0f} |"
    )
    return row, 1.0 / MOST < ratio < MOST


def main() -> None:
    """Print the table; exit with 1 if a scatter was not predicted."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=SCENES, metavar="PARTICLES:SPEED")
    parser.add_argument("--runs", type=int, default=10)
    given = parser.parse_args()
    print("| n | v0/v* | eta | contacts | amplification | predicted | scatter | ratio | s |")
    print("|---|---|---|---|---|---|---|---|---|")
    missed = 0
    for each in given.scenes:
        particles, speed = each.split(":")
        row, held = compare(int(particles), float(speed), given.runs)
        print(row, flush=True)
        missed += not held
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
