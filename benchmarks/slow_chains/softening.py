"""
Chains whose bonds soften by compression, beside the curve at negative y.

    python -m benchmarks.slow_chains.softening

Prints n^(2/3) (1 - eta) of Toda's bond with compression and stretch exchanged: means over lengths
within 5 %, their standard error, and theory. No random numbers.
"""

import numpy as np

from chaincor.analysis.slow_chains.curve import (
    slow_chain_dissipation,
    slow_chain_variable,
)
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide

BOND = {"potential": "formula", "energy": "(exp(10*(r-1)) - 1)/100 - (r-1)/10"}
VARIABLES = (-1.0, -5.0, -12.0)
SIZES = ((100, 7), (300, 5), (1000, 3))


def main() -> None:
    """Measure and print."""
    for variable in VARIABLES:
        for size, count in SIZES:
            losses, expected = [], []
            for part in np.linspace(0.95, 1.05, count):
                n = round(size * part)
                scene = Scene(**BOND, particles=n, velocity=1e-3, engine="reference")
                velocity = variable / slow_chain_variable(scene.bond, n, 1.0)
                scale = n ** (2.0 / 3.0)
                found = collide(scene.replace(velocity=velocity), tolerance=1e-3 / scale)
                losses.append((1.0 - found.restitution) * scale)
                expected.append(slow_chain_dissipation(scene.bond, n, velocity) * scale)
            error = np.std(losses, ddof=1) / count**0.5
            print(
                f"y = {variable:g}, n = {size}: {np.mean(losses):.4f} +- {error:.4f}, "
                f"theory {np.mean(expected):.4f}"
            )


if __name__ == "__main__":
    main()
