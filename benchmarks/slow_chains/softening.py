"""
Compare chains whose bonds soften in compression with the curve at negative y.

    python -m benchmarks.slow_chains.softening [--bonds NAME ...] [--longest N]

Prints n^(2/3) (1 - eta) for Toda bonds with compression and stretch exchanged, and for the bond ln
cosh s = s^2/2 - s^4/12 + ... Results are means over lengths within 5 %, standard errors, and
theory.
"""

import argparse

import numpy as np

from chaincor.analysis.slow_chains.curve import (
    slow_chain_dissipation,
    slow_chain_variable,
)
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide

BONDS = {
    "toda": {"potential": "formula", "energy": "(exp(10*(r-1)) - 1)/100 - (r-1)/10"},
    "quartic": {"potential": "formula", "energy": "log(cosh(r-1))"},
}
VARIABLES = (-1.0, -5.0, -12.0)
SIZES = ((100, 7), (300, 5), (1000, 3))
# Largest speed at which the theory of slow chains is used.
FASTEST = 0.6


def measure(name: str, variable: float, size: int, count: int) -> None:
    """Print the mean loss of chains with similar lengths, and theory."""
    losses, expected = [], []
    for part in np.linspace(0.95, 1.05, count):
        n = round(size * part)
        scene = Scene(**BONDS[name], particles=n, velocity=1e-3, engine="reference")
        order = scene.bond.anharmonic_order
        velocity = (variable / slow_chain_variable(scene.bond, n, 1.0)) ** (1.0 / (order - 2))
        if velocity > FASTEST:
            print(f"{name}, y = {variable:g}, n = {n}: not slow, v0 = {velocity:.2f}")
            return
        scale = n ** (2.0 / 3.0)
        found = collide(scene.replace(velocity=velocity), tolerance=1e-3 / scale)
        losses.append((1.0 - found.restitution) * scale)
        expected.append(slow_chain_dissipation(scene.bond, n, velocity) * scale)
    error = np.std(losses, ddof=1) / count**0.5
    distance = (np.mean(losses) - np.mean(expected)) * size ** (2.0 / 3.0)
    print(
        f"{name}, y = {variable:g}, n = {size}: {np.mean(losses):.4f} +- {error:.4f}, "
        f"theory {np.mean(expected):.4f}, difference times n^(2/3) {distance:.1f}",
        flush=True,
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--bonds", nargs="+", choices=BONDS, default=list(BONDS), help="bonds")
    parser.add_argument("--longest", type=int, default=1000, help="largest length")
    arguments = parser.parse_args()
    for size, count in SIZES:
        for name in arguments.bonds:
            for variable in VARIABLES:
                if size <= arguments.longest:
                    measure(name, variable, size, count)


if __name__ == "__main__":
    main()
