"""
A second method for the front: Fourier modes and exponential time differencing.

    python -m benchmarks.slow_chains.spectral

Writes ``spectral.csv`` beside itself, with h_3(y) by this method, by the finite differences of
``analysis.slow_chains.front``, and their difference over the sum of both errors. The two methods
share no code: grid, derivatives, steps in time, smoothing of the step and absorbing layer differ.
No random numbers; ten minutes.
"""

import csv
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.slow_chains.front import front_loss
from chaincor.lammps_inputs.arrays import Array

Modes = NDArray[np.complex128]

# Lengths in widths of the linear front. Its waves run to the left alone and end in a sponge.
_AHEAD, _BEHIND, _SPONGE = 12.0, 40.0, 40.0
# The fastest wave leaves the sponge with exp(-15) of what it had.
_DAMPING = 15.0
# The step is smooth over so many grid spacings; one spacing is this for slow chains.
_SMOOTH, _SPACING = 3.2, 0.1
# ETDRK4 is stable for rates below about 2.5 per step; solitons have twice the step's height.
_STABLE, _TALLEST = 0.7, 2.2
_WIDE = 3.0


TABLE = Path(__file__).with_name("spectral.csv")
VARIABLES = [0.0, 1.0, 5.0, 12.0, *map(float, range(13, 37)), 40.0, 50.0, 60.0]


def spectral_loss(variable: float, order: int = 3) -> tuple[float, float]:
    """
    Return the loss of slow long chains and its error, from two grids.

    Parameters
    ----------
    variable : float
        y, 0 or more.
    order : int
        Lowest anharmonic order r.

    Returns
    -------
    tuple of float
        The loss and what the extrapolation adds to it, which is taken as the error.
    """
    spacing = _SPACING / math.sqrt(max(1.0, variable / 5.0))
    fine, coarse = (_Front(variable, order - 2, step).loss() for step in (spacing, 1.4 * spacing))
    # The smooth step has an error of the third power of its width.
    change = (fine - coarse) / (1.4**3 - 1.0)
    return fine + change, abs(change)


class _Front:
    """One grid, and the front on it as its difference from a fixed wide one."""

    def __init__(self, variable: float, power: int, spacing: float) -> None:
        from scipy.fft import next_fast_len, rfftfreq

        self._y, self._power = variable, power
        left, right = _BEHIND + 1.5 * variable, _AHEAD + 2.0 * variable
        self._count = next_fast_len(math.ceil((_SPONGE + left + right) / spacing), real=True)
        self.spacing = (_SPONGE + left + right) / self._count
        self.x = self.spacing * np.arange(self._count) - left - _SPONGE
        self._ik = 2j * np.pi * rfftfreq(self._count, self.spacing)
        fastest = float(abs(self._ik[-1]))
        strength = _DAMPING * fastest**2 / (0.5 * _SPONGE)
        depth = np.maximum(0.0, -left - self.x) / _SPONGE
        self._sponge, self._left = strength * np.sin(np.pi * depth) ** 2, left
        rate = 0.5 * strength + 0.5 * max(variable, 0.3) * _TALLEST**power * fastest
        self._steps = math.ceil(rate / _STABLE)

    def loss(self) -> float:
        """Send the front to the free end and back and return n^(2/3) (1 - eta)."""
        from scipy.integrate import cumulative_simpson
        from scipy.interpolate import CubicSpline
        from scipy.special import erfc

        width = _SMOOTH * self.spacing
        # A kernel without a second moment has a smoothing error of the fourth power of its width.
        z = self.x / width
        step = 0.5 * erfc(z) - 0.5 * z * np.exp(-(z**2)) / math.sqrt(math.pi)
        back = self._carried(1.0 - self._carried(step, falling=True), falling=False)
        # Momentum that the wall has not given when the place x of the front arrives.
        missing = cumulative_simpson(2.0 * (1.0 - back)[::-1], dx=self.spacing, initial=0.0)[::-1]
        deficit = self.x + missing
        least = int(np.argmin(np.where(self.x > -self._left, deficit, np.inf)))
        near = slice(least - 4, least + 5)
        spline = CubicSpline(self.x[near], deficit[near])
        places = spline.derivative().roots(extrapolate=False)
        plateau = 2.0 * self._y / (self._power + 1)
        return float(spline(places).min()) - plateau

    def _carried(self, front: Array, falling: bool) -> Array:
        """Carry a front for the time 1 by exponential time differencing of order 4."""
        from scipy.fft import irfft, rfft
        from scipy.special import erfc

        x, ik, power, count = self.x, self._ik, self._power, self._count
        bell = np.exp(-((x / _WIDE) ** 2)) / (_WIDE * math.sqrt(math.pi))
        wide, slope = 0.5 * erfc(x / _WIDE), -bell
        bend = bell * (2.0 - 4.0 * x**2 / _WIDE**2) / _WIDE**2
        if not falling:
            wide, slope, bend = 1.0 - wide, -slope, -bend
        source = -self._y * wide**power * slope - bend / 3.0
        flux = -self._y / (power + 1) * ik
        wide_flux = wide ** (power + 1)

        def rest(modes: Modes) -> Modes:
            part = irfft(modes, count)
            steepening = flux * rfft((part + wide) ** (power + 1) - wide_flux)
            return steepening + rfft(source - self._sponge * part)

        step = _ExponentialStep(-(ik**3) / 3.0, 1.0 / self._steps)
        modes = rfft(front - wide)
        for _ in range(self._steps):
            modes = step(modes, rest)
        return irfft(modes, count) + wide


class _ExponentialStep:
    """
    ETDRK4 of S. M. Cox and P. C. Matthews, J. Comput. Phys. 176, 430 (2002).

    Its coefficients are means over a circle in the complex plane, after A.-K. Kassam and L. N.
    Trefethen, SIAM J. Sci. Comput. 26, 1214 (2005), as their formulas cancel at small rates.
    """

    def __init__(self, rates: Modes, step: float) -> None:
        circle = np.exp(2j * np.pi * (np.arange(32) + 0.5) / 32)
        z = step * rates[:, None] + circle
        grown = np.exp(z)
        self._whole, self._half = np.exp(step * rates), np.exp(0.5 * step * rates)
        self._middle = step * ((np.exp(0.5 * z) - 1.0) / z).mean(axis=1)
        self._first = step * ((grown * (4.0 - 3.0 * z + z**2) - 4.0 - z) / z**3).mean(axis=1)
        self._second = step * 2.0 * ((grown * (z - 2.0) + 2.0 + z) / z**3).mean(axis=1)
        self._third = step * ((grown * (4.0 - z) - 4.0 - 3.0 * z - z**2) / z**3).mean(axis=1)

    def __call__(self, modes: Modes, rest: Callable[[Modes], Modes]) -> Modes:
        """Return the modes one step later; `rest` is what is not linear."""
        half, middle = self._half, self._middle
        start = rest(modes)
        one = half * modes + middle * start
        rest_one = rest(one)
        rest_two = rest(half * modes + middle * rest_one)
        three = half * one + middle * (2.0 * rest_two - start)
        ended = self._whole * modes + self._first * start
        return ended + self._second * (rest_one + rest_two) + self._third * rest(three)


def main() -> None:
    """Compare both methods and write the table."""
    with TABLE.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["variable", "spectral", "error", "differences", "error", "apart"])
        for variable in VARIABLES:
            loss, error = spectral_loss(variable)
            front = front_loss(variable, 3, 0.7)
            apart = (loss - front.loss) / (error + front.error)
            numbers = [f"{x:.6f}" for x in (loss, error, front.loss, front.error)]
            writer.writerow([variable, *numbers, f"{apart:.2f}"])
            file.flush()


if __name__ == "__main__":
    main()
