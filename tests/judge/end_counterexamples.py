"""
Are ends argued that are none? A search over random states, not only those that scenes lead to.

    python -m tests.judge.end_counterexamples [--states 2000] [--seed 1] [--processes 2]
        [-o FILE]

A state has one to three pieces of lj, sometimes of log, 2 to 12 particles in all, with random
strains, velocities and distances, particle 1 in front of the wall. The judge follows it; at looks
as an engine has them, it is asked whether the collision has ended. From the first state of each
argument the judge runs on, long. Prints each argument that a contact follows; exit status 1 if
there is one. With -o, these states are written as JSON, to be tests.
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
# States are examined every tenth of a crossing, for twice the time that a first piece is waited
# for.
_LOOKS = 60
# Contacts decide, because momenta of random states may be arbitrarily small.
_ANY = float("inf")


@dataclass(frozen=True)
class State:
    """A chain in front of the wall, and how long ago its last contact was."""

    law: str
    distance: float
    strains: list[float]
    velocities: list[float]
    since_contact: float = 0.0


@dataclass(frozen=True)
class Claim:
    """An argument, the state that it was given for, and what the judge saw after."""

    argument: str
    state: State
    next_contact: float | None
    speed: float | None
    refusal: str | None = None


def argument_for(state: State) -> str | None:
    """Ask for an argument: the only place that knows how."""
    return argue_end(
        state.distance,
        np.array(state.strains),
        np.array(state.velocities),
        state.since_contact,
        _BONDS[state.law],
    )


def draw_state(seed: int, index: int) -> State:
    """Return state `index` of a seed."""
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
    """Return the state so much later, by the judge."""
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
    """Let the judge run on from where an end was argued."""
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
    """Print the figures; return whether nothing followed any claim."""
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
