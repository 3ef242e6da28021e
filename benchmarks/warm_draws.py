"""
Test the distribution of warm states by Kolmogorov-Smirnov, at three temperatures.

    python -m benchmarks.warm_draws [--states 20000] [--seed 1]

Strains are compared with exp(-U/T), which is integrated on a fine grid from the energy alone.
Velocities are compared with Maxwell's distribution at fixed momentum. For springs, the mean energy
of each mode is compared with T.
"""

import argparse
import math

import numpy as np
from scipy import stats

from chaincor.analysis.modes import mode_energies
from chaincor.lammps_inputs.bonds.equilibrium import LEAST_DEPTH, bond_distribution
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.thermal_state import draw

POTENTIALS = {
    "harmonic": {"potential": "harmonic"},
    "lj": {"potential": "lj"},
    "toda": {"potential": "toda"},
    "morse": {"potential": "morse"},
    "log": {"potential": "log"},
    "power, order 3": {"potential": "power", "power_order": 3, "power_c": -1.0},
    "power, order 4": {"potential": "power", "power_order": 4, "power_c": 1.0},
    "formula": {"potential": "formula", "energy": "cosh(4*s)/16"},
}
# Temperatures, as fractions of the highest temperature that a bond allows, but at most of 0.1.
PARTS = (1e-4, 1e-2, 1.0)
MASSES = np.array([1.0, 3.0, 2.0, 0.5])
_NONE = np.zeros(0)


def draw_p_values(fields: dict, part: float, seeds: list[int]) -> tuple[float, float, float]:
    """Return the temperature, and the p-values of strains and of velocities (least of four)."""
    bond = Scene(**fields).bond
    held = min(bond.dissociation, bond.barrier, LEAST_DEPTH * 0.1)
    temperature = 0.999 * part * held / LEAST_DEPTH
    drawn = draw(bond, temperature, MASSES, _NONE, seeds)
    grid = np.linspace(*bond_distribution(bond, temperature).edges[[0, -1]], 400_001)
    with np.errstate(all="ignore"):
        density = np.nan_to_num(np.exp(-bond.energy(grid) / temperature))
    below = np.concatenate(([0.0], np.cumsum(density[1:] + density[:-1])))
    below /= below[-1]
    strains = stats.kstest(drawn.strains.ravel(), lambda s: np.interp(s, grid, below)).pvalue
    widths = np.sqrt(temperature / MASSES * (1.0 - MASSES / MASSES.sum()))
    velocities = [
        stats.kstest(v / w, "norm").pvalue for v, w in zip(drawn.velocities.T, widths, strict=True)
    ]
    return temperature, float(strains), float(min(velocities))


def mode_means(particles: int, seeds: list[int]) -> tuple[float, float]:
    """Return differences of modes' mean energies from T in standard errors: largest and rms."""
    bond = Scene(potential="harmonic").bond
    drawn = draw(bond, 1e-3, np.ones(particles), _NONE, seeds)
    places = np.concatenate((np.zeros((len(seeds), 1)), np.cumsum(drawn.strains, axis=1)), axis=1)
    energies = mode_energies(places, drawn.velocities)[:, 1:] / 1e-3
    # E/T is distributed as exp(-E/T), whose standard deviation is 1.
    off = (energies.mean(axis=0) - 1.0) * math.sqrt(len(seeds))
    return float(np.max(np.abs(off))), float(np.sqrt(np.mean(off**2)))


def main() -> None:
    """Print all p-values."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("--states", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    found: list[float] = []

    def next_seeds(modes: int = 0) -> list[int]:
        # With equal seeds, all cases would have the same random numbers, and the same p-value.
        first = given.seed + (len(found) // 2 + modes) * given.states
        return list(range(first, first + given.states))

    print(f"{given.states} states of {len(MASSES)} particles; p-values")
    print(f"{'bond':16} {'T':>10} {'strains':>8} {'velocities, least of 4':>24}")
    for name, fields in POTENTIALS.items():
        for part in PARTS:
            temperature, strains, velocities = draw_p_values(fields, part, next_seeds())
            print(f"{name:16} {temperature:10.3g} {strains:8.3f} {velocities:24.3f}")
            # The least of four p-values is below p with the probability 1 - (1 - p)^4.
            found += [strains, 1.0 - (1.0 - velocities) ** 4]
    uniform = stats.kstest(found, "uniform").pvalue
    print(f"all {len(found)} together, as p-values are distributed evenly: {uniform:.3f}")
    for k, particles in enumerate((2, 8, 50)):
        most, rms = mode_means(particles, next_seeds(k))
        print(
            f"{particles} particles on springs: mean energies of modes are T within {most:.2f} "
            f"standard errors, {rms:.2f} rms"
        )


if __name__ == "__main__":
    main()
