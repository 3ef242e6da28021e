"""
How many force evaluations schemes need for an error of eta.

    python -m benchmarks.schemes.evaluations [--scene NAME ...]

Chains of 100 are carried to their last contact, with contacts located on the map of the step
itself. Counted are the substeps of a run, one for every step and one more for every contact; the
search for contacts, which moves few particles in-house, is not. Between two steps of a ladder
errors are interpolated; of all steps that reach an error the coarsest counts from which on all
finer ones do.
"""

import argparse
import math

import numpy as np

from benchmarks.schemes.candidates import CANDIDATES, Array, Candidate, State
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.by_reference import converge
from chaincor.workflows.engines.contact_search import SEARCH_FIELDS, build_contact_search

SCENES = {
    "lj 0.1 v*": {"potential": "lj", "speed": 0.1},
    "lj 0.4 v*": {"potential": "lj", "speed": 0.4},
    "lj 1 v*": {"potential": "lj", "speed": 1.0},
    "toda 0.4 v*": {"potential": "toda", "speed": 0.4},
    "harmonic": {"potential": "harmonic", "velocity": 0.1},
}
ERRORS = (1e-6, 1e-8, 1e-10, 1e-11)
_REFERENCE = 1e-13
# Steps of a ladder, from so many times an evaluation's share; each is shorter by this factor.
_LONGEST, _LONGEST_PER_STAGE, _SHORTER, _RUNGS = 1.0, 0.03, 2.0**-0.4, 11


def collide(candidate: Candidate, scene: Scene, step: float, last: float) -> tuple[float, int]:
    """Return eta and the force evaluations of a run to a time just past the last contact."""
    n, v0 = scene.particles, scene.impact_velocity
    state: State = (0.0, np.zeros(n - 1), np.full(n, -v0))
    state[2][0] = v0

    def forces(strain: Array) -> Array:
        force = np.concatenate(([0.0], scene.bond.force(strain), [0.0]))
        return force[:-1] - force[1:]

    def first(state: State) -> tuple[float, float, float]:
        x, strain, velocity = state
        return x, float(velocity[0]), -float(scene.bond.force(strain[:1])[0])

    def probe(time: float, start: State) -> tuple[float, float, float]:
        return first(candidate.take_step(start, time, forces))

    find_contact = build_contact_search(probe=probe, register=lambda function: function)
    run_state = np.zeros(1, np.dtype(SEARCH_FIELDS)).view(np.recarray)[0]
    substeps = 0
    for _ in range(math.ceil(last / step)):
        left = step
        while left > 0.0:
            substeps += 1
            end = candidate.take_step(state, left, forces)
            if not np.isfinite(end[0]):
                return np.nan, substeps
            time = find_contact(left, first(state), first(end), run_state, state)
            if time < 0.0:
                state = end
                break
            _, strain, velocity = candidate.take_step(state, time, forces)
            velocity[0] = abs(velocity[0])
            state = (0.0, strain, velocity)
            left -= time
    return float((state[2].mean() / v0) ** 2), substeps * candidate.evaluations


def climb(candidate: Candidate, scene: Scene, eta: float, last: float) -> list[float]:
    """Return the evaluations for each of `ERRORS`; nan where the ladder does not tell."""
    longest = min(_LONGEST, _LONGEST_PER_STAGE * candidate.evaluations * 2.0)
    rungs: list[tuple[float, float]] = []
    for k in range(_RUNGS):
        with np.errstate(all="ignore"):
            found, evaluations = collide(candidate, scene, longest * _SHORTER**k, last)
        error = abs(found - eta) if np.isfinite(found) else np.inf
        rungs.append((error, float(evaluations)))
        if error < 0.1 * min(ERRORS):
            break
    return [_evaluations_for(error, rungs) for error in ERRORS]


def _evaluations_for(error: float, rungs: list[tuple[float, float]]) -> float:
    bad = [k for k, (found, _) in enumerate(rungs) if found > error]
    if not bad:
        return rungs[0][1]
    if bad[-1] == len(rungs) - 1:
        return np.nan
    (high, few), (low, many) = rungs[bad[-1] : bad[-1] + 2]
    if not np.isfinite(high):
        return many
    part = math.log(high / error) / math.log(high / max(low, 1e-16))
    return few * (many / few) ** part


def main() -> None:
    """Print a table for each scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("--scene", nargs="+", choices=SCENES, default=list(SCENES))
    for name in parser.parse_args().scene:
        scene = Scene(particles=100, **SCENES[name])
        reference_value = converge(scene.problem, _REFERENCE)
        last = float(reference_value.outcome.contact_times[-1]) + 1e-3
        print(f"\n| {name} | {' | '.join(f'{error:.0e}' for error in ERRORS)} |")
        print("|---" * (1 + len(ERRORS)) + "|")
        for label, candidate in CANDIDATES.items():
            counts = climb(candidate, scene, reference_value.restitution, last)
            shown = " | ".join("-" if np.isnan(c) else f"{round(c, -2):.0f}" for c in counts)
            print(f"| {label} | {shown} |", flush=True)


if __name__ == "__main__":
    main()
