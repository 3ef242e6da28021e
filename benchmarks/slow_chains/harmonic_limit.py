"""
Limit of n^(2/3) (1 - eta) for harmonic chains, from up to a million particles.

    python -m benchmarks.slow_chains.harmonic_limit [--sizes 1000 10000 100000 1000000]

Adds the missing chains to ``harmonic_limit.csv`` in this folder: 13 lengths from 0.94 to 1.06 of
each size. Results scatter with the phase of the last contacts, not because of errors. An
interrupted run can be repeated and keeps the finished chains.
"""

import argparse
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.slow_chains.growing_table import growing_table
from chaincor.analysis.slow_chains.harmonic import collide_long_chains, front_lead
from chaincor.analysis.theory import harmonic_dissipation_limit
from chaincor.lammps_inputs.arrays import Array

TABLE = Path(__file__).with_name("harmonic_limit.csv")
HEADER = ["particles", "loss", "contacts", "last_contact_time"]
SIZES = [100, 300, 1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000]
SPREAD = np.linspace(0.94, 1.06, 13)
# Powers of n for the remainder in the fits: neglected terms, and the end of the push for n -> inf.
_REMAINDERS = (-2.0 / 3.0, -8.0 / 15.0)


def measure(sizes: list[int]) -> None:
    """Add the chains that the table lacks, as soon as they are computed."""
    lengths = {round(size * part) for size in sizes for part in SPREAD}
    with growing_table(TABLE, HEADER) as (rows, add):
        known = {row[0] for row in rows}
        for chain in collide_long_chains(n for n in lengths if str(n) not in known):
            row = [chain.particles, f"{1.0 - chain.restitution:.12e}", chain.contacts]
            add([[*row, f"{chain.last_contact_time:.4f}"]])


def means() -> tuple[Array, Array, Array]:
    """Return sizes, means of n^(2/3) (1 - eta), and errors of the means."""
    rows = np.loadtxt(TABLE, delimiter=",", skiprows=1, usecols=(0, 1))
    particles, loss = rows[np.argsort(rows[:, 0])].T
    groups = (particles ** (2.0 / 3.0) * loss).reshape(-1, len(SPREAD))
    sizes = particles.reshape(-1, len(SPREAD)).mean(axis=1)
    return sizes, groups.mean(axis=1), groups.std(axis=1, ddof=1) / len(SPREAD) ** 0.5


def remainders() -> list[tuple[float, float, float]]:
    """Return n, the difference of the mean from theory with beta, and the mean's error."""
    sizes, found, errors = means()
    theory = harmonic_dissipation_limit() + 2.0 * front_lead() * sizes ** (-1.0 / 3.0)
    return list(zip(sizes, found - theory, errors, strict=True))


def fit() -> None:
    """Print means by size, and fits with two powers for the remainder."""
    sizes, found, errors = means()
    limit, lead = harmonic_dissipation_limit(), front_lead()
    print(
        "| n | n^(2/3) (1 - eta) | mean's error | difference | x n^(2/3) |\n|---|---|---|---|---|"
    )
    for mean, (n, rest, error) in zip(found, remainders(), strict=True):
        print(f"| {n:.0f} | {mean:.5f} | {error:.5f} | {rest:.5f} | {rest * n ** (2 / 3):.2f} |")
    for power, least in product(_REMAINDERS, (300, 1000, 3000, 10_000)):
        used = sizes > 0.9 * least
        n, values, bars = sizes[used], found[used], errors[used]
        powers = np.stack([np.ones_like(n), n ** (-1.0 / 3.0), n**power], axis=1)
        print(
            f"n^({power:.3f}) from n = {least}: "
            f"all free {_weighted(powers, values, bars)} ({limit:.5f}, {2 * lead:.4f}); "
            f"limit known {_weighted(powers[:, 1:], values - limit, bars)}"
        )


def _weighted(powers: Array, values: Array, errors: Array) -> str:
    """Return the factors of a weighted fit with their errors, and its chi2."""
    weighted = powers / errors[:, None]
    best = np.linalg.lstsq(weighted, values / errors, rcond=None)[0]
    bars = np.sqrt(np.diag(np.linalg.inv(weighted.T @ weighted)))
    chi = float(np.sum(((values - powers @ best) / errors) ** 2))
    factors = ", ".join(f"{x:.4f} +- {bar:.4f}" for x, bar in zip(best, bars, strict=True))
    return f"{factors}, chi2 {chi:.1f} for {len(values) - len(best)}"


def main() -> None:
    """Compute the missing chains, unless `--fit` is given, and print the fit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES)
    parser.add_argument("--fit", action="store_true", help="use the table that is there")
    arguments = parser.parse_args()
    if not arguments.fit:
        measure(arguments.sizes)
    fit()


if __name__ == "__main__":
    main()
