r"""
Compute the lags of the leading solitons at the free end, and measure how C'(y) depends on them.

    python -m benchmarks.slow_chains.lag [--variable Y]

The equation is u_t + 6 u u_x + u_xxx = 0, with t = (y/2)^(3/2)/3. The lag of soliton k is
:math:`\delta_k = 4t - x_k`. The reflection coefficient of the step has the jump
:math:`4 h \sqrt{1 - h^2}` across its cut k = i h, h < 1. Near the leading solitons, the cut alone
gives the front, as a determinant. `soliton_lag` has the limit of late times.

The study also moves the first N solitons of the modulated wave backwards by a length d and computes
the way back to the wall. A shift of the whole front lowers C' by d/(6 t). The weight of the first N
solitons is the measured change of C' divided by this change. The study prints the weight of the
deepest minimum and the weight without the oscillation of `limit`.
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


def determinant_wave(x: float, time: float) -> float:
    """
    Return u(x) near the leading solitons of a step, u = 2 d^2/dx^2 ln det(1 + G).

    The kernel is G(h, h') = v(h) v(h')/(h + h'), v^2 = (2/pi) h sqrt(1 - h^2) exp(8 h^3 t - 2 h x),
    from the saddle point h = sqrt(x/12t) to 1.
    """
    nodes, weights = np.polynomial.legendre.leggauss(80)
    # v^2 decays with 16 t (1 - h) and has a root at h = 1.
    width = min(math.sqrt(1.0 - math.sqrt(x / (12.0 * time))), math.sqrt(60.0 / (16.0 * time)))
    q = 0.5 * width * (nodes + 1.0)
    h = 1.0 - q**2
    density = width * weights * q * (2.0 / math.pi) * h * np.sqrt(1.0 - h**2)
    v = np.sqrt(density) * np.exp(4.0 * h**3 * time - h * x)
    kernel = np.outer(v, v) / np.add.outer(h, h)
    solved = np.linalg.solve(np.eye(len(h)) + kernel, v)
    return float(4.0 * (h * v) @ solved - 2.0 * (v @ solved) ** 2)


def determinant_lag(number: int, time: float) -> float:
    """
    Return the lag 4 t - x of the crest of a soliton; the first has number 1.

    Rounding errors grow with the number and the time: 1e-4 for soliton 3 at y = 60.
    """
    from scipy.optimize import minimize_scalar

    guess = soliton_lag(number, time)
    bounds = (guess - 0.3, guess + 0.6)
    return float(
        minimize_scalar(
            lambda lag: -determinant_wave(4.0 * time - lag, time),
            bounds=bounds,
            options={"xatol": 1e-7},
        ).x
    )


def soliton_lag(number: int, time: float) -> float:
    """Return the lag of a soliton at late times, with a relative error of ln(t)/t."""
    late = (number - 0.25) * math.log(64.0 * time) - 0.5 * math.lgamma(2 * number)
    return late + 0.25 * math.log(math.pi) - 1.25 * math.log(2.0)


def main() -> None:
    """Print the lags and the weights of the leading solitons."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--variable", type=float, default=60.0, help="y")
    y = parser.parse_args().variable
    spacing, courant = GRIDS[0]
    scale = math.sqrt(0.5 * y)
    time = scale**3 / 3.0
    for number in (1, 2, 3):
        lag, late = determinant_lag(number, time), soliton_lag(number, time)
        print(f"soliton {number}: lag {lag:.4f}, beyond the form {lag - late:.4f}", flush=True)
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
