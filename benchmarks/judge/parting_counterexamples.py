"""
Are ends of two bodies proved that are none? A search over random states.

    python -m benchmarks.judge.parting_counterexamples [--states 2000] [--seed 1] [--processes 2]

Two chains of lj, harmonic or log bonds, 1 to 8 particles each, of unequal masses, with random
strains, velocities and gap; now and then a wall in place of the second. From where the end is first
proved, the judge runs on, long. Prints each proof that a contact follows; exit status 1 if there is
one.
"""

import argparse
import multiprocessing
from collections import Counter
from functools import partial

import numpy as np

from benchmarks.judge.bodies import Bodies, Bonds, Unsure, crossing_time, run_once
from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones, Logarithmic
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.end_watch import EndWatch
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.moving import Motion, Stepper

_BONDS = {"lj": LennardJones(), "harmonic": Harmonic(), "log": Logarithmic()}
_LOOKS = 60
_STEP = 0.02
_SHARE = 0.35
# How long the judge runs on at most, and at least for a verdict.
_STEPS, _CROSSINGS = 100_000, 20.0


def draw_state(seed: int, index: int) -> tuple[str, Line]:
    """Return state `index` of a seed."""
    random = np.random.default_rng([seed, index])
    law = str(random.choice(["lj", "lj", "harmonic", "log"]))
    chain, target = (int(random.integers(1, 9)) for _ in range(2))
    masses = 10 ** random.uniform(-1, 1, size=chain + target)
    if random.uniform() < 0.2:
        target, masses = 1, np.concatenate(([np.inf], masses[:chain]))
    count = len(masses)
    strains = np.clip(10 ** random.uniform(-2.5, -0.5) * random.normal(size=count - 1), -0.1, 1.0)
    if law == "lj":
        torn = random.uniform(size=count - 1) < 0.1
        strains[torn] = 10 ** random.uniform(-0.7, 1.0, size=int(torn.sum()))
    strains[target - 1] = 10 ** random.uniform(-3, 1)
    velocities = 10 ** random.uniform(-2.5, -0.7) * random.normal(size=count)
    velocities[target:] += random.uniform(-0.1, 0.2)
    velocities[np.isinf(masses)] = 0.0
    return law, Line(masses, target, strains, velocities)


def find_proof(law: str, line: Line) -> Line | None:
    """Return the state in which the end is first proved."""
    bond = _BONDS[law]
    stepper = Stepper.of(line, bond, "order8", _STEP)
    state = line.strains, line.velocities
    moving = Motion.in_state(stepper, *state, 0.1)
    ledger = moving.ledger
    bookkeeping.never_argue(ledger)
    particles = max(line.first, len(line.chain_masses))
    stiffness = 1.0 / line.mean_mass
    for _ in range(_LOOKS):
        watch = EndWatch(particles, bond, stiffness)
        if not ledger.touching and moving.gap > 0.0:
            now = float(ledger.steps) * _STEP
            ending = watch.look_at(now, now, moving.bodies())
            if ending == Ending("proved"):
                return Line(line.masses, line.first, *moving.along_x())
        interval = 0.1 * (particles + 5.0) / stiffness**0.5
        if moving.advance(int(ledger.steps) + max(1, round(interval / _STEP))):
            return None
    return None


def try_state(index: int, seed: int) -> str:
    """Return what became of one state."""
    law, line = draw_state(seed, index)
    proved = find_proof(law, line)
    if proved is None:
        return "not proved"
    bodies = Bodies(proved.masses, proved.velocities, proved.strains, proved.first)
    try:
        run_once(Bonds(law), bodies, _SHARE, most_steps=_STEPS)
    except Unsure as seen:
        # Bodies that never meet are followed until steps run out.
        if seen.contacts == 0:
            far = seen.time > _CROSSINGS * crossing_time(bodies)
            return "proved, and right" if far else "proved, not judged"
    return f"proved, and wrong: state {index}"


def main() -> None:
    """Run the search from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("--states", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    with multiprocessing.get_context("spawn").Pool(given.processes) as pool:
        found = Counter(pool.imap(partial(try_state, seed=given.seed), range(given.states), 20))
    for what, count in sorted(found.items()):
        print(f"{what}: {count}")
    raise SystemExit(1 if any("wrong" in what for what in found) else 0)


if __name__ == "__main__":
    main()
