"""
Compare chains of six bonds with the curve of slow long chains, at fixed y.

    python -m benchmarks.slow_chains.lattices [--fit | --check]

Adds the missing chains to ``lattices.csv`` in this folder. The reference engine computes n^(2/3) (1
- eta) to 2e-3. Results for a size are means over lengths within 6 %, because losses scatter with
the phase of the last contacts. An interrupted run can be repeated and keeps the finished chains.
With 1/b as the unit of length, Toda chains of all b are the same chain.

Chains of 8000 particles or more run once, with one step and without a comparison of steps, which
would take 12 times longer. Their error is the largest difference between such runs and the compared
runs of shorter chains: ``--check``.
"""

import argparse
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.slow_chains.growing_table import growing_table
from chaincor.analysis.slow_chains.curve import FRONT_LEAD, limiting_loss, slow_chain_variable
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.reference import stepping

TABLE = Path(__file__).with_name("lattices.csv")
BONDS = {
    "lj": {"potential": "lj"},
    "toda": {"potential": "toda"},
    "log": {"potential": "log"},
    "quartic": {"potential": "power", "power_order": 4, "power_c": 1.0},
}
OTHER_B = {f"toda b = {b:g}": {"potential": "toda", "toda_b": b} for b in (3.0, 30.0)}
VARIABLES = [0.3, 1.0, 3.0, 5.0, 12.0, 30.0]
# Size, and number of lengths near it.
SIZES = [(30, 13), (100, 13), (300, 7), (1000, 5), (3000, 1), (10_000, 1)]
_LONGEST = 10_000
_OF_LONGEST = (1.0, 3.0, 12.0)
_OF_OTHER_B = (_LONGEST, 3.0)
# Values of y across the oscillation of C', with single lengths. Their scatter is much smaller than
# the loss.
SWING, SWING_SIZES = (18.0, 24.0, 36.0), (500, 700, 1000, 1400, 2000, 2800, 4000)
# Chains that run once, their scheme and step, and the error of their loss.
SINGLE_RUNS = (8000, 16_000, 32_000)
_SINGLE_RUN = Numerics(scheme="srkn14", timestep=0.7)
_SINGLE_RUN_ERROR = 6e-7
# Fits of the terms after 2 beta n^(-1/3): shortest chain, and powers of the fitted terms. The power
# of the remainder is unknown at these lengths.
_FITS = tuple(
    product(
        (900, 2500), ((-2.0 / 3.0,), (-8.0 / 15.0,), (-2.0 / 3.0, -1.0), (-2.0 / 3.0, -4.0 / 3.0))
    )
)
# Largest steepness of the front. The theory of slow chains requires a small steepness.
FASTEST = 0.6
# Scatter of single lengths, from 13 harmonic chains with lengths within 6 %.
_SCATTER = {3000: 0.016, 10_000: 0.005}
HEADER = ["bond", "order", "variable", "particles", "velocity", "loss", "error"]


def wanted():
    """Yield the name of the bond, its order, y, and the scene with the speed for this y."""
    for size, count in SIZES:
        parts = np.linspace(0.94, 1.06, count) if count > 1 else [1.0]
        for variable in VARIABLES:
            if size == _LONGEST and variable not in _OF_LONGEST:
                continue
            for name, bond in (BONDS | OTHER_B).items():
                if name in OTHER_B and (size, variable) != _OF_OTHER_B:
                    continue
                for part in parts:
                    particles = round(size * part)
                    scene = scene_of(bond, variable, particles)
                    order = scene.bond.anharmonic_order
                    if variable / particles ** (2.0 / 3.0) < FASTEST and (
                        order == 3 or variable < 13
                    ):
                        yield name, order, variable, scene
    yield from wanted_for_swing()


def scene_of(bond: dict[str, Any], variable: float, particles: int) -> Scene:
    """Return the scene of a chain with the speed for y."""
    chain = {**bond, "particles": particles, "engine": "reference"}
    known = Scene(**chain, velocity=1e-3).bond
    unit = slow_chain_variable(known, particles, 1.0)
    return Scene(**chain, velocity=(variable / unit) ** (1.0 / (known.anharmonic_order - 2)))


def wanted_for_swing():
    """Yield chains for the oscillation of C': cubic bonds, and shorter chains of another b."""
    bonds = {name: bond for name, bond in BONDS.items() if name != "quartic"}
    for particles, variable in product(SWING_SIZES + SINGLE_RUNS, SWING):
        other = {"toda b = 3": OTHER_B["toda b = 3"]} if particles <= 1400 else {}
        for name, bond in (bonds | other).items():
            yield name, 3, variable, scene_of(bond, variable, particles)


def measure() -> None:
    """Add the collisions that the table lacks, as soon as they are computed."""
    with growing_table(TABLE, HEADER) as (rows, add):
        known = {tuple(row[:4]) for row in rows}
        for name, order, variable, scene in wanted():
            n = scene.particles
            row = (name, str(order), str(variable), str(n))
            if row in known:
                continue
            known.add(row)
            if n in SINGLE_RUNS and variable in SWING:
                loss, error = single_run(scene), _SINGLE_RUN_ERROR
            else:
                result = collide(scene, tolerance=2e-3 * n ** (-2.0 / 3.0))
                loss, error = 1.0 - result.restitution, result.restitution_error
            add([[*row, f"{scene.velocity:.9g}", f"{loss:.9g}", f"{error:.1e}"]])


def single_run(scene: Scene) -> float:
    """Return 1 - eta from one run."""
    return 1.0 - stepping.run(scene, _SINGLE_RUN, follow=False).eta


def check() -> None:
    """Print the difference between a single run and the table, for chains of 1400 to 4000."""
    rows = np.genfromtxt(TABLE, delimiter=",", names=True, dtype=None, encoding="utf-8")
    for name, _, variable, particles, _, loss, error in rows:
        if variable in SWING and particles in SWING_SIZES and particles >= 1400 and name in BONDS:
            difference = single_run(scene_of(BONDS[name], variable, int(particles))) - loss
            print(f"{name}, y = {variable:g}, n = {particles}: {difference:.1e} ({error:.1e})")


@dataclass(frozen=True)
class Mean:
    """Mean of n^(2/3) (1 - eta) for one bond, y and size, and the theoretical results."""

    bond: str
    variable: float
    size: int
    factor: float
    error: float
    limit: float
    with_lead: float


def means() -> list[Mean]:
    """Return the means of the table by bond, y and size."""
    rows = np.genfromtxt(TABLE, delimiter=",", names=True, dtype=None, encoding="utf-8")
    found = []
    for name, variable, (size, _) in product(BONDS | OTHER_B, VARIABLES, SIZES):
        chosen = rows[(rows["bond"] == name) & (rows["variable"] == variable)]
        chosen = chosen[abs(chosen["particles"] / size - 1.0) < 0.07]
        if not len(chosen):
            continue
        n, factor = chosen["particles"], chosen["loss"] * chosen["particles"] ** (2.0 / 3.0)
        error = factor.std(ddof=1) / len(n) ** 0.5 if len(n) > 1 else np.nan
        limit = float(limiting_loss(variable, int(chosen["order"][0])))
        lead = 2.0 * FRONT_LEAD * np.mean(n ** (-1.0 / 3.0))
        mean = float(factor.mean())
        found.append(Mean(name, variable, size, mean, error, limit, limit + lead))
    return found


def compare() -> None:
    """Print means and theory by size, and how fast the means approach the theory."""
    table = means()
    print("| bond | y | n | n^(2/3) (1 - eta) | mean's error | limit | with beta |")
    print("|---|---|---|---|---|---|---|")
    for row in table:
        print(
            f"| {row.bond} | {row.variable:g} | {row.size} | {row.factor:.4f} | {row.error:.4f} | "
            f"{row.limit:.4f} | {row.with_lead:.4f} |"
        )
    swing()
    for name, power in product(BONDS, (-2.0 / 3.0, -8.0 / 15.0)):
        chosen = [row for row in table if row.bond == name]
        lead, error, chi, freedom = fitted_lead(chosen, power)
        print(
            f"{name}, remainder n^({power:.3f}): ({lead:.3f} +- {error:.3f}) n^(-1/3), "
            f"chi2 {chi:.0f} for {freedom}"
        )


def swing() -> None:
    """Print C'(y) of long chains with 2 beta n^(-1/3) subtracted, and its limit by eight fits."""
    rows = np.genfromtxt(TABLE, delimiter=",", names=True, dtype=None, encoding="utf-8")
    for name, variable in product(("lj", "toda", "log"), SWING):
        chosen = rows[(rows["bond"] == name) & (rows["variable"] == variable)]
        chosen = np.sort(chosen, order="particles")
        n = chosen["particles"].astype(float)
        slopes = chosen["loss"] * n ** (2.0 / 3.0) - 2.0 * FRONT_LEAD * n ** (-1.0 / 3.0)
        slopes /= variable
        limits = [_extrapolated(n[n > least], slopes[n > least], fit) for least, fit in _FITS]
        longest = ", ".join(
            f"{size} {slope:.4f}"
            for size, slope in zip(chosen["particles"], slopes, strict=True)
            if size in (2000, *SINGLE_RUNS)
        )
        print(
            f"{name}, y = {variable:g}: {longest}, fits {min(limits):.4f} to {max(limits):.4f}, "
            f"theory {float(limiting_loss(variable)) / variable:.4f}"
        )


def _extrapolated(n: Array, slopes: Array, powers: tuple[float, ...]) -> float:
    """Return the limit of C' for long chains."""
    design = np.stack([np.ones_like(n), *(n**power for power in powers)], axis=1)
    return float(np.linalg.lstsq(design, slopes, rcond=None)[0][0])


def fitted_lead(rows: list[Mean], power: float) -> tuple[float, float, float, int]:
    """
    Fit the factor of n^(-1/3) in the difference from the curve, with a remainder for each y <= 3.

    Returns the factor, its error including scatter, chi2 and the degrees of freedom.
    """
    rows = [row for row in rows if row.size >= 100 and row.variable <= 3.0]
    n = np.array([row.size for row in rows], dtype=float)
    errors = np.array([_SCATTER.get(row.size, 0.0) or row.error for row in rows])
    own = [
        np.where([row.variable == variable for row in rows], n**power, 0.0)
        for variable in sorted({row.variable for row in rows})
    ]
    design = np.stack([n ** (-1.0 / 3.0), *own], axis=1) / errors[:, None]
    found = np.array([row.factor - row.limit for row in rows]) / errors
    best = np.linalg.lstsq(design, found, rcond=None)[0]
    chi, freedom = float(np.sum((found - design @ best) ** 2)), len(rows) - len(best)
    variance = np.linalg.inv(design.T @ design)[0, 0]
    return float(best[0]), float(np.sqrt(variance * max(chi / freedom, 1.0))), chi, freedom


def main() -> None:
    """Compute the missing chains, unless `--fit` is given, and print the comparison."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fit", action="store_true", help="use the table that is there")
    parser.add_argument("--check", action="store_true", help="check the single runs")
    arguments = parser.parse_args()
    if arguments.check:
        check()
        return
    if not arguments.fit:
        measure()
    compare()


if __name__ == "__main__":
    main()
