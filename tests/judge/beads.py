"""
Compare random columns of beads with an integrator that shares no code.

``python -m tests.judge.beads --first 1000 --count 200`` prints one line for each column: its seed,
the difference between the two values of eta and the sum of their error bars. Masses, gaps,
exponents, targets, walls and damping are random.
"""

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from chaincor import Scene, collide


def _beads(**fields):
    return Scene(**{"potential": "hertz", "velocity": 0.1, "engine": "reference"} | fields)


def independent_loss(masses, targets, exponent, gaps, hard, damping, tolerance):
    """
    Return 1 - eta by SciPy's DOP853 with the wall, or target, as an event.

    Beads are ordered along x. A target, or a soft wall that never moves, is in front of the chain.
    Positions are measured from those of touching beads.
    """
    wall = not len(targets)
    every = np.concatenate((targets[::-1] if not wall else [np.inf], masses))
    first = len(every) - len(masses)
    x = np.concatenate((np.zeros(first), np.cumsum(np.concatenate(([0.0], gaps)))))
    v = np.concatenate((np.zeros(first), -np.ones(len(masses))))

    def rates(_time, state):
        overlaps = np.maximum(state[: len(every) - 1] - state[1 : len(every)], 0.0)
        forces = overlaps**exponent
        if damping:
            factor, power = damping
            closing = -np.diff(state[len(every) :])
            drag = factor * np.where(overlaps > 0.0, overlaps**power, 0.0) * closing
            forces = np.maximum(forces + drag, 0.0)
        if hard:
            forces[first - 1] = 0.0
        push = np.append(0.0, forces) - np.append(forces, 0.0)
        return np.concatenate((state[len(every) :], push / every))

    def touches(_time, state):
        return state[first] - state[first - 1]

    touches.terminal, touches.direction = hard, -1.0
    state, now = np.concatenate((x, v)), 0.0
    for number in range(400):
        velocities = state[len(every) :]
        closing = velocities[first - 1] - velocities[first]
        if hard and closing > 0.0 and state[first] - state[first - 1] <= 1e-9:
            given = 2.0 * closing / (1.0 / every[first - 1] + 1.0 / every[first])
            velocities[first - 1] -= given / every[first - 1]
            velocities[first] += given / every[first]
            state[first] = state[first - 1] + 1e-15
        found = solve_ivp(
            rates,
            (now, now + 5.0 * 1.03**number),
            state,
            "DOP853",
            events=touches,
            rtol=tolerance,
            atol=tolerance,
        )
        state, now = found.y[:, -1].copy(), found.t[-1]
        x, v = state[: len(every)], state[len(every) :]
        apart = np.min(np.diff(x)) >= -1e-9 and np.min(np.diff(v)) >= -1e-7
        if found.status == 0 and apart:
            break
    else:
        raise AssertionError("the beads do not part")
    speed = masses @ v[first:] / np.sum(masses)
    if not wall:
        speed -= targets[::-1] @ v[:first] / np.sum(targets)
    return 1.0 - speed**2


def _column(seed):
    random = np.random.default_rng(seed)
    masses = np.exp(random.uniform(-1.0, 1.0, random.integers(1, 9)))
    targets = np.exp(random.uniform(-1.0, 1.0, random.integers(1, 5) * (seed % 3 == 0)))
    exponent = float(random.uniform(1.2, 3.0))
    gaps = random.uniform(0.0, 0.5, len(masses) - 1) * (seed % 2)
    hard = bool(random.integers(2))
    factor, dashpot = float(random.uniform(0.02, 0.3)), bool(random.integers(2))
    damping = (factor, 0.0 if dashpot else exponent - 1.0) if seed % 4 == 0 else ()
    return masses, targets, exponent, gaps, hard, damping


def _scene_of(column, folder):
    masses, targets, exponent, gaps, hard, damping = column
    fields = {"hertz_exponent": exponent, "particles": len(masses), "velocity": 1.0}
    if hard:
        fields["contact"] = "hard"
    if damping:
        fields["damping"] = damping[0]
        fields["damping_law"] = "viscoelastic" if damping[1] else "dashpot"
    if len(targets):
        fields |= {"target_particles": len(targets), "target_masses": tuple(targets.tolist())}
    if np.any(gaps):
        rows = [f"{s:.17g},{m:.17g}" for s, m in zip([0.0, *gaps], masses, strict=True)]
        path = folder / "column.csv"
        path.write_text("\n".join(["strain,mass", *rows]))
        return _beads(**fields, initial=path)
    return _beads(**fields, masses=tuple(masses.tolist()))


@dataclass(frozen=True)
class Judged:
    """Comparison of one random column."""

    distance: float  #: Difference between the two values of eta.
    allowed: float  #: Sum of the two error bars.
    ending: str


def judge_column(seed, folder):
    """
    Compare the engine with the other integrator for a random column.

    The error bar of the other integrator comes from a second run at ten times the tolerance.
    """
    column = _column(seed)
    result = collide(_scene_of(column, Path(folder)), tolerance=1e-8)
    # The difference of the other integrator's two runs gets a safety factor of three.
    loss, rough = (independent_loss(*column, tolerance) for tolerance in (1e-12, 1e-11))
    allowed = result.restitution_error + 3.0 * abs(loss - rough) + 1e-10
    return Judged(abs(1.0 - result.restitution - loss), allowed, result.ending)


def main():
    """Judge the requested columns."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1000)
    parser.add_argument("--count", type=int, default=200)
    asked = parser.parse_args()
    inside = 0
    for number, seed in enumerate(range(asked.first, asked.first + asked.count), 1):
        with tempfile.TemporaryDirectory() as folder:
            judged = judge_column(seed, folder)
        inside += judged.distance <= judged.allowed
        print(f"{seed} {judged.distance:.2e} {judged.allowed:.2e} {judged.ending}", flush=True)
        print(f"inside: {inside} of {number}", flush=True)


if __name__ == "__main__":
    main()
