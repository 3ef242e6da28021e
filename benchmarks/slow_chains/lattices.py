"""
Compare chains of six bonds with the curve of slow long chains, at fixed y.

    python -m benchmarks.slow_chains.lattices [--fit]

Adds the missing chains to ``lattices.csv`` in this folder. The reference engine computes n^(2/3) (1
- eta) to 2e-3. Results for a size are means over lengths within 6 %, because losses scatter with
the phase of the last contacts. An interrupted run can be repeated and keeps the finished chains.
With 1/b as the unit of length, Toda chains of all b are the same chain.
"""

import argparse
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.slow_chains.growing_table import growing_table
from chaincor.analysis.slow_chains.curve import FRONT_LEAD, limiting_loss, slow_chain_variable
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide

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
# Fits of the terms after 2 beta n^(-1/3): shortest chain, and powers of the fitted terms.
_FITS = ((900, (-2.0 / 3.0,)), (450, (-2.0 / 3.0, -4.0 / 3.0)))
# Fits whose range is printed, because the power of the remainder is unknown.
_ALL_FITS = tuple(
    product((450, 900), ((-2.0 / 3.0,), (-2.0 / 3.0, -1.0), (-2.0 / 3.0, -4.0 / 3.0)))
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
                    scene = Scene(**bond, particles=particles, velocity=1e-3, engine="reference")
                    order = scene.bond.anharmonic_order
                    unit = slow_chain_variable(scene.bond, particles, 1.0)
                    velocity = (variable / unit) ** (1.0 / (order - 2))
                    if variable / particles ** (2.0 / 3.0) < FASTEST and (
                        order == 3 or variable < 13
                    ):
                        yield name, order, variable, scene.model_copy(update={"velocity": velocity})
    yield from wanted_for_swing()


def wanted_for_swing():
    """Yield chains for the oscillation of C': cubic bonds, and shorter chains of another b."""
    bonds = {name: bond for name, bond in BONDS.items() if name != "quartic"}
    for particles, variable in product(SWING_SIZES, SWING):
        other = {"toda b = 3": OTHER_B["toda b = 3"]} if particles <= 1400 else {}
        for name, bond in (bonds | other).items():
            scene = Scene(**bond, particles=particles, velocity=1e-3, engine="reference")
            velocity = variable / slow_chain_variable(scene.bond, particles, 1.0)
            yield name, 3, variable, scene.model_copy(update={"velocity": velocity})


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
            result = collide(scene, tolerance=2e-3 * n ** (-2.0 / 3.0))
            loss, error = 1.0 - result.restitution, result.restitution_error
            add([[*row, f"{scene.velocity:.9g}", f"{loss:.9g}", f"{error:.1e}"]])


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
    for name in BONDS:
        power, error, chi, freedom = fitted_power([row for row in table if row.bond == name])
        print(f"{name}: 2 beta n^-({power:.3f} +- {error:.3f}), chi2 {chi:.0f} for {freedom}")


def swing() -> None:
    """Print C'(y), extrapolated to long chains by two fits with known beta."""
    rows = np.genfromtxt(TABLE, delimiter=",", names=True, dtype=None, encoding="utf-8")
    for variable, name in product(SWING, ("lj", "toda", "log")):
        chosen = rows[(rows["bond"] == name) & (rows["variable"] == variable)]
        n = chosen["particles"].astype(float)
        known = chosen["loss"] * n ** (2.0 / 3.0) - 2.0 * FRONT_LEAD * n ** (-1.0 / 3.0)
        extrapolated = {
            (least, fit): _extrapolated(n[n > least], known[n > least], fit)
            for least, fit in _ALL_FITS
        }
        slopes, errors = np.array([extrapolated[fit] for fit in _FITS]).T / variable
        every = [loss / variable for loss, _ in extrapolated.values()]
        # Half the difference of the fits plus the larger of their errors.
        bar = 0.5 * np.ptp(slopes) + errors.max()
        theory = float(limiting_loss(variable)) / variable
        print(
            f"y = {variable:g}, {name}, {len(n)} lengths to {n.max():.0f}: "
            f"C' {slopes.mean():.4f} +- {bar:.4f}, six fits {min(every):.4f} to {max(every):.4f}, "
            f"longest chain {known[n.argmax()] / variable:.4f}, theory {theory:.4f}"
        )


def _extrapolated(n: Array, losses: Array, powers: tuple[float, ...]) -> tuple[float, float]:
    """Return the limit of the losses, and its error due to scatter."""
    design = np.stack([np.ones_like(n), *(n**power for power in powers)], axis=1)
    best = np.linalg.lstsq(design, losses, rcond=None)[0]
    rest = losses - design @ best
    variance = float(rest @ rest) / (len(n) - len(best))
    return float(best[0]), float(np.sqrt(variance * np.linalg.inv(design.T @ design)[0, 0]))


def fitted_power(rows: list[Mean]) -> tuple[float, float, float, int]:
    """
    Fit p in the difference from the curve, 2 beta n^(-p) + c n^(-2/3), with c for each y <= 3.

    Returns p, its error including scatter, chi2 and the degrees of freedom.
    """
    from scipy.optimize import least_squares

    rows = [row for row in rows if row.size >= 100 and row.variable <= 3.0]
    variables = sorted({row.variable for row in rows})
    which = [variables.index(row.variable) for row in rows]
    n = np.array([row.size for row in rows], dtype=float)
    found = np.array([row.factor - row.limit for row in rows])
    errors = np.array([_SCATTER.get(row.size, 0.0) or row.error for row in rows])

    def residuals(parameters):
        power, *rest = parameters
        fitted = 2.0 * FRONT_LEAD * n**-power + np.array(rest)[which] * n ** (-2.0 / 3.0)
        return (fitted - found) / errors

    best = least_squares(residuals, [1.0 / 3.0] + [-6.0] * len(variables))
    freedom = len(rows) - len(best.x)
    variance = np.linalg.inv(best.jac.T @ best.jac)[0, 0]
    chi = 2.0 * float(best.cost)
    return float(best.x[0]), float(np.sqrt(variance * max(chi / freedom, 1.0))), chi, freedom


def main() -> None:
    """Compute the missing chains, unless `--fit` is given, and print the comparison."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fit", action="store_true", help="use the table that is there")
    if not parser.parse_args().fit:
        measure()
    compare()


if __name__ == "__main__":
    main()
