"""
Limit of n^(2/3) (1 - eta) for harmonic chains, from up to a million particles.

    python -m benchmarks.slow_chains.harmonic_limit [--sizes 1000 10000 100000 1000000]

Adds the missing chains to ``harmonic_limit.csv`` in this folder: 13 lengths from 0.94 to 1.06 of
each size. Results scatter with the phase of the last contacts, not because of errors. An
interrupted run can be repeated and keeps the finished chains.
"""

import argparse
from pathlib import Path

import numpy as np

from benchmarks.slow_chains.growing_table import growing_table
from chaincor.analysis.slow_chains.harmonic import collide_long_chains, front_lead
from chaincor.analysis.theory import harmonic_dissipation_limit

TABLE = Path(__file__).with_name("harmonic_limit.csv")
HEADER = ["particles", "loss", "contacts", "last_contact_time"]
SIZES = [100, 300, 1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000]
SPREAD = np.linspace(0.94, 1.06, 13)


def measure(sizes: list[int]) -> None:
    """Add the chains that the table lacks, as soon as they are computed."""
    lengths = {round(size * part) for size in sizes for part in SPREAD}
    with growing_table(TABLE, HEADER) as (rows, add):
        known = {row[0] for row in rows}
        for chain in collide_long_chains(n for n in lengths if str(n) not in known):
            row = [chain.particles, f"{1.0 - chain.restitution:.12e}", chain.contacts]
            add([[*row, f"{chain.last_contact_time:.4f}"]])


def fit() -> None:
    """Print means by size, and extrapolations of the means."""
    rows = np.loadtxt(TABLE, delimiter=",", skiprows=1, usecols=(0, 1))
    particles, loss = rows[np.argsort(rows[:, 0])].T
    factor, lead = particles ** (2.0 / 3.0) * loss, front_lead()
    groups = factor.reshape(-1, len(SPREAD))
    sizes = particles.reshape(-1, len(SPREAD)).mean(axis=1)
    means = groups.mean(axis=1)
    errors = groups.std(axis=1, ddof=1) / len(SPREAD) ** 0.5
    limit = harmonic_dissipation_limit()
    print("| n | n^(2/3) (1 - eta) | mean's error | theory with beta | difference x n^(2/3) |")
    print("|---|---|---|---|---|")
    for n, mean, error in zip(sizes, means, errors, strict=True):
        theory = limit + 2.0 * lead * n ** (-1.0 / 3.0)
        rest = (mean - theory) * n ** (2.0 / 3.0)
        print(f"| {n:.0f} | {mean:.5f} | {error:.5f} | {theory:.5f} | {rest:.2f} |")
    for least in (300, 1000, 3000, 10_000):
        used = sizes > 0.9 * least
        powers = np.vander(sizes[used] ** (-1.0 / 3.0), 3, increasing=True)
        weighted = powers / errors[used][:, None]
        values = np.linalg.lstsq(weighted, means[used] / errors[used], rcond=None)[0]
        spread = np.sqrt(np.diag(np.linalg.inv(weighted.T @ weighted)))
        chi = np.sum(((means[used] - powers @ values) / errors[used]) ** 2)
        print(
            f"from n = {least}: limit {values[0]:.5f} +- {spread[0]:.5f} ({limit:.5f}), "
            f"n^(-1/3) {values[1]:.3f} +- {spread[1]:.3f} ({2 * lead:.3f}), "
            f"n^(-2/3) {values[2]:.2f}, chi2 {chi:.1f} for {used.sum() - 3}"
        )
        slope, cov = np.polyfit(
            np.log(sizes[used]),
            np.log(means[used] - limit),
            1,
            w=(means[used] - limit) / errors[used],
            cov="unscaled",
        )
        print(f"  distance to {limit:.5f}: exponent {slope[0]:.4f} +- {cov[0, 0] ** 0.5:.4f}")


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
