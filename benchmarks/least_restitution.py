"""Find the masses of harmonic chains with the least restitution at a hard wall, by gradients.

Prints for n = 2 to 10 masses the smallest e = sqrt(eta) that was found, e at the start of this
search, the time of all searches, and the result of LAMMPS. Searches begin at the best of many
random chains, at the best shorter chain with an additional mass, and at the results of earlier
searches. Minima are mostly at corners of e, at which a new contact appears. Only some of many local
minima are found, and e is therefore an upper bound of the minimum.

Run: python -m benchmarks.least_restitution [--chains 2-10] [--starts 5] [--seed 1]
"""

import argparse
import time

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide

Array = NDArray[np.float64]

_VELOCITY = 0.1
# Smallest and largest mass, divided by the last mass.
_LIGHTEST, _HEAVIEST = 0.02, 50.0
_SHARP, _OF_LAMMPS = 1e-9, 1e-6
# Largest number of searches from one start, each from the result of the previous one, and the
# smallest improvement after which a further search begins.
_SEARCHES, _SETTLED = 5, 1e-6
# Number of random chains for each start of a search. The best chains become the starts.
_SEEN = 12
# Masses that are added at the free end of a shorter chain, divided by the neighbouring mass.
_ADDED = 0.2, 1.0
# Results of earlier searches, which are also used as starts.
_KNOWN = {
    3: (3.0665868, 1.2179801, 1.0),
    4: (4.7501191, 2.3462866, 0.34711512, 1.0),
    5: (4.1026057, 2.0410654, 0.29832374, 0.1188528, 1.0),
    6: (7.3789717, 3.8342821, 0.68424469, 0.39360894, 0.30995298, 1.0),
    7: (36.493046, 18.622843, 3.3945326, 1.965271, 1.5512568, 5.0357829, 1.0),
}
# Restitution of a chain that cannot be simulated.
_REFUSED = 1.0


def scene_of(logarithms: Array, engine: str = "reference") -> Scene:
    """Return the scene of a harmonic chain, from the logarithms of masses divided by the last."""
    return Scene(
        potential="harmonic",
        particles=len(logarithms) + 1,
        masses=tuple(np.exp(np.append(logarithms, 0.0)).tolist()),
        velocity=_VELOCITY,
        engine=engine,
        tolerance=_SHARP if engine == "reference" else _OF_LAMMPS,
    )


def value_and_slope(logarithms: Array) -> tuple[float, Array]:
    """Return e, and its derivatives with respect to the logarithms."""
    scene = scene_of(logarithms)
    try:
        result = collide(scene)
        by_mass = result.sensitivity.masses
    except ChaincorError:
        return _REFUSED, np.zeros(len(logarithms))
    e = result.kinematic_restitution
    return e, (0.5 / e * by_mass * scene.line.chain_masses)[:-1]


def descend(start: Array) -> tuple[float, Array, int]:
    """Return the smallest e of a search, its logarithms, and the number of collisions."""
    bounds = [(np.log(_LIGHTEST), np.log(_HEAVIEST))] * len(start)
    best, of_best, runs = np.inf, start, 0

    def seen(logarithms: Array) -> tuple[float, Array]:
        nonlocal best, of_best, runs
        e, slope = value_and_slope(logarithms)
        runs += 1
        if e < best:
            best, of_best = e, logarithms.copy()
        return e, slope

    # A search that ended at a corner begins again at this corner, without its old curvature.
    for _ in range(_SEARCHES):
        before = best
        minimize(seen, of_best, jac=True, method="L-BFGS-B", bounds=bounds)
        if best > before - _SETTLED:
            break
    return best, of_best, runs


def least(starts: list[Array]) -> tuple[float, float, Array, int]:
    """Return e before and after the best search, its logarithms, and the number of collisions."""
    found, runs = (np.inf, np.inf, starts[0]), 0
    for start in starts:
        e, at, took = descend(start)
        runs += took + 1
        if e < found[1]:
            found = value_and_slope(start)[0], e, at
    return *found, runs


def starts_of(particles: int, count: int, rng: np.random.Generator) -> list[Array]:
    """Return the best of many random chains."""
    drawn = rng.normal(0.0, np.sqrt(2.0), (_SEEN * count, particles - 1))
    drawn = np.clip(drawn, np.log(_LIGHTEST), np.log(_HEAVIEST))
    return sorted(drawn, key=lambda each: value_and_slope(each)[0])[:count]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--chains", default="2-10", help="lengths of the table, as 2-10")
    parser.add_argument("--starts", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    shortest, longest = (int(each) for each in given.chains.split("-"))
    rng, at = np.random.default_rng(given.seed), np.zeros(0)
    print("| n | equal masses | start | least e | collisions | s | LAMMPS | masses |")
    print("|---|---|---|---|---|---|---|---|")
    for particles in range(shortest, longest + 1):
        begun = time.process_time()
        starts = starts_of(particles, given.starts, rng)
        if particles > shortest:
            longer = [np.append(at, 0.0) - np.log(added) for added in _ADDED]
            starts += [np.minimum(each, np.log(_HEAVIEST)) for each in longer]
        if particles in _KNOWN:
            starts.append(np.log(_KNOWN[particles][:-1]))
        start, e, at, runs = least(starts)
        runs += _SEEN * given.starts
        seconds = time.process_time() - begun
        equal, _ = value_and_slope(np.zeros(particles - 1))
        try:
            lammps = collide(scene_of(at, "lammps"))
            by_lammps = lammps.kinematic_restitution
            bar = (lammps.restitution_error or np.nan) / (2.0 * by_lammps)
            said = f"{by_lammps:.7f} +- {bar:.0e}"
        except ChaincorError as error:
            said = str(error)
        masses = ", ".join(f"{mass:.8g}" for mass in np.exp(np.append(at, 0.0)))
        print(
            f"| {particles} | {equal:.4f} | {start:.4f} | {e:.7f} | {runs} | {seconds:.0f} "
            f"| {said} | {masses} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
