"""Compare how often late contacts occur with the estimate of their probability.

Random lj chains hit the wall, and are simulated for 400 crossings of sound after their last
contact. A trial begins when there has been no contact for the time that sound needs to cross the
chain and return, and the end is not proved. The outcome of a trial is whether a contact follows.
Trials are sorted in two ways: by the probability of a contact that ``ending.return_risk`` estimates
at this time, and by the energy per bond in the chain, divided by the energy that breaks a bond.
Prints both tables, with the upper end of Wilson's interval of 95 %. The exit status is 1 if the
whole interval of a rate exceeds the estimate.

Run: python -m benchmarks.late_risk [--scenes 2000] [--seed 1]
"""

import argparse
import math
import sys
from typing import NamedTuple

import numpy as np

from chaincor.analysis.distribution import wilson_interval
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.ending import return_risk, sound_round_trip
from chaincor.workflows.engines.fragments import Fragments
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.moving import Motion, Stepper

PARTICLES, SPEEDS = (4, 41), (0.3, 1.8)
# Verlet step. Random motions need not be accurate.
STEP = 0.02
FOLLOWED = 400.0
# Time between two checks for contacts, in crossings of sound.
LOOKS = 1.0


class Trial(NamedTuple):
    """Estimate, energy per bond divided by the energy that breaks a bond, and the outcome."""

    risk: float
    energy: float
    contact: bool


def trials_of(scene: Scene) -> list[Trial]:
    """Return the trials of a collision."""
    bond, n = scene.bond, scene.particles
    stepper = Stepper.of(scene.line, bond, "verlet", STEP)
    moving = Motion.at_start(scene.problem, stepper)
    bookkeeping.never_argue(moving.run_state)
    crossing, quiet = n / math.sqrt(bond.stiffness), sound_round_trip(n, bond.stiffness)
    found: list[Trial] = []
    asked: Trial | None = None
    contacts = 1
    while True:
        target_steps = int(moving.run_state["steps"]) + math.ceil(LOOKS * crossing / STEP)
        status = moving.advance(target_steps)
        while status == bookkeeping.FULL:
            moving.make_room()
            status = moving.advance(target_steps)
        if status != bookkeeping.DONE:
            return found  # Verlet steps do not resolve a bond
        now, last = int(moving.run_state["steps"]) * STEP, float(moving.run_state["last_contact"])
        if int(moving.run_state["contacts"]) != contacts:
            if asked is not None:
                found.append(asked._replace(contact=True))
            contacts, asked = int(moving.run_state["contacts"]), None
        if asked is None and now - last > quiet:
            pieces = moving.bodies()[0].pieces(bond)
            risk = return_risk(pieces, bond)
            if risk == 0.0:
                return found
            asked = Trial(risk, _energy(pieces) / bond.dissociation, False)
        if asked is not None and now - last > FOLLOWED * crossing:
            return [*found, asked]


def _energy(pieces: Fragments) -> float:
    """Return the internal energy per bond of the first fragment."""
    return float(pieces.energies[0]) / max(1, int(pieces.sizes[0]) - 1)


def table(name: str, rows: dict[str, list[Trial]]) -> bool:
    """Print rates; return whether each rate is consistent with its estimate."""
    print(f"| {name} | trials | estimate, on average | contacts | rate, at most |")
    print("|---|---|---|---|---|")
    held = True
    for row, trials in rows.items():
        count, met = len(trials), sum(trial.contact for trial in trials)
        low, high = wilson_interval(met, count)
        estimate = float(np.mean([trial.risk for trial in trials]))
        print(f"| {row} | {count} | {estimate:.1e} | {met} | {high:.1e} |")
        held = held and low <= estimate
    return held


def main() -> None:
    """Print the tables; exit with 1 if an estimate is too low."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng, trials = np.random.default_rng(given.seed), []
    for _ in range(given.scenes):
        n, speed = int(rng.integers(*PARTICLES)), float(rng.uniform(*SPEEDS))
        scene = Scene(potential="lj", particles=n, speed=speed, engine="reference")
        trials += trials_of(scene)
    print(f"{given.scenes} scenes, {len(trials)} silences whose end is not proved")
    by_risk: dict[str, list[Trial]] = {}
    by_energy: dict[str, list[Trial]] = {}
    for trial in sorted(trials):
        decade = max(-9, math.floor(math.log10(trial.risk) + 1e-9))
        by_risk.setdefault(f"1e{decade}" if decade > -9 else "1e-9 or less", []).append(trial)
    for trial in sorted(trials, key=lambda trial: trial.energy):
        by_energy.setdefault(f"{math.floor(trial.energy * 5) / 5:.1f}", []).append(trial)
    held = table("estimate from", by_risk)
    table("energy a bond from", by_energy)
    sys.exit(0 if held else 1)


if __name__ == "__main__":
    main()
