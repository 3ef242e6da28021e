"""
Measure how C'(y) depends on the positions of the leading solitons at the free end.

    python -m benchmarks.slow_chains.lag [--variable Y]

The study moves the first N solitons of the modulated wave backwards by a length d and computes the
way back to the wall. A shift of the whole front lowers C' by d/(6 t), in units of the equation
u_t + 6 u u_x + u_xxx = 0 with t = (y/2)^(3/2)/3. The weight of the first N solitons is the measured
change of C' divided by this change. The study prints the weight of the deepest minimum and the
weight without the oscillation of `limit`.
"""

import argparse
import math

import numpy as np

from benchmarks.slow_chains.limit import without_swing
from benchmarks.slow_chains.modulated import GRIDS, modulated_grid, modulated_wave, way_back
from chaincor.lammps_inputs.arrays import Array

# Length by which the solitons move, in units of u_t + 6 u u_x + u_xxx = 0.
_LENGTH = 0.4
# Width of the smooth shift, as a part of the distance between two solitons.
_WIDTH = 0.12
_NUMBERS = (1, 2, 3, 5, 8)


def moved_wave(x: Array, time: float, solitons: int, length: float) -> Array:
    """
    Return the modulated wave with its first solitons moved backwards.

    Parameters
    ----------
    x : numpy.ndarray
        Increasing positions, in units of the equation u_t + 6 u u_x + u_xxx = 0.
    time : float
        Time since the step.
    solitons : int
        Number of solitons that move, at least 1.
    length : float
        Length of the shift, less than half the distance between two solitons.

    Returns
    -------
    numpy.ndarray
        u. The trough behind the last moved soliton becomes shorter.
    """
    from scipy.special import erf

    wave = modulated_wave(x, time)
    crests = x[1:-1][(wave[1:-1] > wave[:-2]) & (wave[1:-1] >= wave[2:])][::-1]
    near, far = crests[solitons - 1], crests[solitons]
    old = np.linspace(x[0], x[-1] + length, 8 * len(x))
    ahead = 0.5 * (1.0 + erf((old - 0.5 * (near + far)) / (_WIDTH * (near - far))))
    return modulated_wave(np.interp(x, old - length * ahead, old), time)


def main() -> None:
    """Print the weight of the leading solitons."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--variable", type=float, default=60.0, help="y")
    y = parser.parse_args().variable
    spacing, courant = GRIDS[0]
    scale = math.sqrt(0.5 * y)
    time = scale**3 / 3.0
    x = modulated_grid(y, spacing)

    def slopes(wave: Array) -> Array:
        found = np.array(way_back(x, wave, y, courant))
        return np.array([found[0, 1] / y, without_swing(y, found[:, 0], found[:, 1])])

    start = slopes(modulated_wave(x * scale, time))
    for number in _NUMBERS:
        moved = slopes(moved_wave(x * scale, time, number, _LENGTH))
        weight, smooth = (start - moved) * 6.0 * time / _LENGTH
        print(f"{number} solitons: weight {weight:.2f}, without swing {smooth:.2f}", flush=True)


if __name__ == "__main__":
    main()
