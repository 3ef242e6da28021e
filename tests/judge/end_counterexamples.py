"""
Search random states for collisions that an engine would wrongly declare ended.

    python -m tests.judge.end_counterexamples [--states 2000] [--seed 1] [--processes 2]
        [-o FILE]

The states need not occur in any scene. A state is a chain of 2 to 12 particles in one to three
pieces, with lj or sometimes log bonds, random strains and velocities, and a random distance from
the wall to particle 1. The judge integrates it. At regular intervals, as in an engine, the program
asks whether an argument shows that the collision has ended. When an argument first does, the judge
continues for a long time. The program prints each argument that is followed by a contact, and then
exits with status 1. With -o, it writes these states as JSON for use in tests.
"""

import argparse
import json
import multiprocessing
from collections import Counter
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.bonds.potentials import LennardJones, Logarithmic
from chaincor.workflows.engines.ending import argue_end
from tests.judge.judge import JudgeRefusal, Law, judge

_BONDS = {"lj": LennardJones(), "log": Logarithmic()}
_LOG_SHARE = 0.2
# States are examined every tenth of a sound crossing, for twice the time that an engine waits for a
# first piece.
_LOOKS = 60
# Only contacts count: restitution may differ arbitrarily, because momenta of random states may be
# arbitrarily small.
_ANY = float("inf")


@dataclass(frozen=True)
class State:
    """A chain in front of the wall, and the time since its last contact."""

    law: str
    distance: float
    strains: list[float]
    velocities: list[float]
    since_contact: float = 0.0


@dataclass(frozen=True)
class Claim:
    """An argument for the end, the state that it was given for, and the next contact, if any."""

    argument: str
    state: State
    next_contact: float | None
    speed: float | None
    refusal: str | None = None


def argument_for(state: State) -> str | None:
    """Return the argument for the end in a state, or None."""
    return argue_end(
        state.distance,
        np.array(state.strains),
        np.array(state.velocities),
        state.since_contact,
        _BONDS[state.law],
    )


def draw_state(seed: int, index: int) -> State:
    """Return the random state with this seed and index."""
    random = np.random.default_rng([seed, index])
    law = "log" if random.uniform() < _LOG_SHARE else "lj"
    particles = int(random.integers(2, 13))
    pieces = int(random.integers(1, min(3, particles) + 1))
    cuts = np.sort(random.choice(particles - 1, pieces - 1, replace=False))
    # lj breaks at strains of 0.1 and speeds of 0.24, and the random scales lie on both sides.
    strains = np.clip(10 ** random.uniform(-2, -0.5) * random.normal(size=particles - 1), -0.3, 2.0)
    strains[cuts] = 10 ** random.uniform(-0.7, 1.3, size=len(cuts))
    velocities = 10 ** random.uniform(-2.5, -0.5) * random.normal(size=particles)
    drift = np.sort(random.uniform(-0.1, 0.2, size=pieces))
    if random.uniform() < 0.3:
        random.shuffle(drift)
    piece = np.searchsorted(cuts, np.arange(particles), side="left")
    return State(
        law, 10 ** random.uniform(-3, 1), strains.tolist(), (velocities + drift[piece]).tolist()
    )


def follow(state: State, until: float) -> State:
    """Return the state after a time `until`, integrated by the judge."""
    found = judge(
        Law(state.law), state.distance, state.strains, state.velocities,
        multiple=0.0, least_time=until, accuracy=_ANY,
    )  # fmt: skip
    last = -state.since_contact if found.contacts == 0 else found.last_contact_time
    return State(
        state.law, found.distance, found.strains.tolist(), found.velocities.tolist(),
        found.horizon - last,
    )  # fmt: skip


def check(argument: str, state: State) -> Claim:
    """Let the judge continue from the state for which an argument was given."""
    try:
        found = judge(
            Law(state.law), state.distance, state.strains, state.velocities, accuracy=_ANY
        )
    except JudgeRefusal as error:
        return Claim(argument, state, None, None, str(error))
    if found.contacts == 0:
        return Claim(argument, state, None, None)
    return Claim(argument, state, found.contact_times[0].item(), found.contact_speeds[0].item())


def try_state(index: int, seed: int) -> list[Claim]:
    """Follow one state and check the first claim of each argument."""
    state = draw_state(seed, index)
    interval = (len(state.velocities) + 10.0) / 10.0
    claims: dict[str, Claim] = {}
    for _ in range(_LOOKS):
        argument = argument_for(state)
        if argument is not None and argument not in claims:
            claims[argument] = check(argument, state)
        try:
            state = follow(state, interval)
        except JudgeRefusal:
            break
    return list(claims.values())


def report(states: int, claims: list[Claim]) -> bool:
    """Print the counts; return whether no claim was followed by a contact."""
    made = Counter(claim.argument for claim in claims)
    false = [claim for claim in claims if claim.next_contact is not None]
    wrong = Counter(claim.argument for claim in false)
    print(f"states: {states}, not judged: {sum(c.refusal is not None for c in claims)}")
    for argument, count in sorted(made.items()):
        print(f"  {argument}: {count} claims, {wrong[argument]} followed by a contact")
    for claim in sorted(false, key=lambda claim: (claim.argument, len(claim.state.velocities)))[
        :20
    ]:
        print(
            f"  {claim.argument}, {claim.state.law}, n = {len(claim.state.velocities)}, x1 = "
            f"{claim.state.distance:.3g}: hits {claim.next_contact:.4g} later at {claim.speed:.2g}"
        )
    return not false


def main() -> None:
    """Run the search from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("--states", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("-o", "--output", type=Path)
    given = parser.parse_args()
    with multiprocessing.get_context("spawn").Pool(given.processes) as pool:
        trials = pool.imap(partial(try_state, seed=given.seed), range(given.states), chunksize=20)
        claims = [claim for found in trials for claim in found]
    if given.output:
        false = [asdict(claim) for claim in claims if claim.next_contact is not None]
        given.output.write_text(json.dumps(false, indent=1) + "\n")
    raise SystemExit(0 if report(given.states, claims) else 1)


if __name__ == "__main__":
    main()
