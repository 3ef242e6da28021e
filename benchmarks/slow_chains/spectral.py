"""
Compute the front by a second method: Fourier modes and exponential time differencing.

    python -m benchmarks.slow_chains.spectral [--variables Y ...] [--order R]

Adds the missing values of y to ``spectral.csv`` in this folder: the deepest minima of the loss, as
in ``analysis/slow_chains/curves.csv``. This method shares no code with the finite differences of
``analysis.slow_chains.front``: grid, derivatives, time steps, start and absorbing layer differ.

The front depends on y and the time T only through y T^(2/3). A step is therefore integrated on a
fine grid to y = `_FIRST`, and the rescaled front is the start of the steeper problem. On the way
back the grid moves with the front.
"""

import argparse
import math
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.slow_chains.growing_table import growing_table
from chaincor.lammps_inputs.arrays import Array

Modes = NDArray[np.complex128]

TABLE = Path(__file__).with_name("spectral.csv")
HEADER = ["order", "variable", "place", "loss", "error"]
VARIABLES = {
    3: [*map(float, range(13, 37)), 40.0, 45.0, 50.0, 60.0, 70.0, 80.0, 100.0, 120.0, 160.0],
    4: [12.0, 20.0, 30.0, 45.0],
}
# Number of minima in the table for each y.
_MINIMA = 6
# Largest y that starts with a step, and the spacing of its grid.
_FIRST, _FIRST_SPACING = {1: 5.0, 2: 3.0}, 0.05
# Spacing of steeper problems, in widths of the leading soliton.
_SPACING = 0.3
# Time step times the rate of the steepest front.
_COURANT = 1.0
# Ratio of the time steps of the two runs that give the error, and order of the steps.
_COARSER, _ORDER = 1.5, 4
# Lengths of the grid ahead, behind and in the absorbing layer, in widths of the linear front.
_AHEAD, _BEHIND, SPONGE = 13.0, 25.0, 25.0
# Length behind the first front, whose tail later becomes steeper.
_FIRST_BEHIND = 45.0
# Fraction of the train that is kept behind the step, and its largest length for cubic bonds.
_REAR, _LONGEST_REAR = {1: 0.3, 2: 0.5}, 18.0
# Damping rate of the fastest wave, divided by its squared wave number.
_DAMPING = 0.48
# The highest modes are removed after each step. The phase of these modes changes by more than 2 pi
# per step, so they resonate with the front and grow.
_FILTER, _FILTER_ORDER = 36.0, 24
# Height of the leading soliton, and width of the smooth step that is subtracted from the front.
_TALLEST, _WIDE = 2.0, 3.0


def spectral_minima(variable: float, order: int = 3) -> list[tuple[float, float, float]]:
    """
    Return position, loss and error of the deepest minima, beginning with the deepest.

    Parameters
    ----------
    variable : float
        y, 0 or more.
    order : int
        Lowest anharmonic order r: 3 or 4.

    Returns
    -------
    list of tuple of float
        Losses are extrapolated from two runs. The error is the change by the extrapolation.
    """
    fine, coarse = (
        minima(*front_at_wall(variable, order, f), variable, order) for f in (1.0, _COARSER)
    )
    found = []
    for place, loss in fine[:_MINIMA]:
        nearest = min(coarse, key=lambda other: abs(other[0] - place))[1]
        change = (loss - nearest) / (_COARSER**_ORDER - 1.0)
        found.append((place, loss + change, abs(change)))
    return found


def front_at_wall(variable: float, order: int = 3, coarser: float = 1.0) -> tuple[Array, Array]:
    """
    Integrate the front to the free end and back.

    Parameters
    ----------
    variable : float
        y, 0 or more.
    order : int
        Lowest anharmonic order r: 3 or 4.
    coarser : float
        Factor of the time step, and of the first grid's spacing.

    Returns
    -------
    x, w : numpy.ndarray
        Positions in the front, and the scaled compression W at these positions, when the front is
        at the wall.
    """
    power = order - 2
    if variable <= _FIRST[power]:
        x, front = _started(variable, power, coarser)
    else:
        x, front = _steepened(variable, power, coarser)
    courant = _COURANT * coarser
    back = carried(x, 1.0 - front, variable, power, 1.0, courant, frame=variable)
    inside = x > x[0] + SPONGE
    return (x + variable)[inside], back[inside]


def minima(x: Array, back: Array, variable: float, order: int) -> list[tuple[float, float]]:
    """Return position and loss of each minimum of the missing impulse, deepest first."""
    from scipy.integrate import cumulative_simpson
    from scipy.interpolate import make_interp_spline

    missing = cumulative_simpson(2.0 * (1.0 - back)[::-1], dx=x[1] - x[0], initial=0.0)[::-1]
    deficit = x + missing
    lowest = np.flatnonzero((deficit[1:-1] < deficit[:-2]) & (deficit[1:-1] <= deficit[2:])) + 1
    found = []
    for least in lowest[(lowest > 8) & (lowest < len(x) - 8)]:
        near = slice(least - 5, least + 6)
        places = np.linspace(x[least - 1], x[least + 1], 2001)
        values = make_interp_spline(x[near], deficit[near], k=5)(places)
        found.append((float(places[values.argmin()]), float(values.min())))
    plateau = 2.0 * variable / (order - 1)
    return sorted(((place, least - plateau) for place, least in found), key=lambda pair: pair[1])


@lru_cache(maxsize=8)
def _started(variable: float, power: int, coarser: float) -> tuple[Array, Array]:
    """Return the grid and the front at the free end, starting from a step."""
    spacing = _FIRST_SPACING * coarser
    x = front_grid(_FIRST_BEHIND + variable, _AHEAD + 2.0 * variable, spacing)
    return x, carried(x, _step(x), variable, power, 1.0, _COURANT * coarser)


def _step(x: Array) -> Array:
    """Return the step with all wave numbers that the grid resolves, except the largest few."""
    from scipy.fft import irfft, rfftfreq
    from scipy.special import erfc

    spacing = x[1] - x[0]
    k = 2.0 * np.pi * rfftfreq(len(x), spacing)
    beside = np.zeros_like(k)
    # Fourier transform of the step minus the smooth step, divided by -i.
    beside[1:] = (1.0 - np.exp(-((0.5 * _WIDE * k[1:]) ** 2))) / k[1:]
    kept = np.exp(-36.0 * (k / k[-1]) ** 12)
    modes = -1j * beside * kept * np.exp(1j * k * x[0]) / spacing
    return 0.5 * erfc(x / _WIDE) - irfft(modes, len(x))


def _steepened(variable: float, power: int, coarser: float) -> tuple[Array, Array]:
    """Return the grid and the front at the free end, from the rescaled front of a smaller y."""
    from scipy.interpolate import make_interp_spline

    first = _FIRST[power]
    scale = math.sqrt(first / variable)
    width = 1.0 / math.sqrt(0.5 * variable if power == 1 else 2.0 * variable)
    rear = _REAR[power] * variable
    rear = min(rear, _LONGEST_REAR) if power == 1 else rear
    x = front_grid(rear + _BEHIND, 2.0 * variable / 3.0 + _AHEAD, _SPACING * width)
    places, values = _started(first, power, coarser)
    known = (x > scale * places[0]) & (x < scale * places[-1])
    front = np.where(x < 0.0, 1.0, 0.0)
    front[known] = make_interp_spline(scale * places, values, k=5)(x[known])
    return x, carried(x, front, variable, power, 1.0 - scale**3, _COURANT * coarser)


def front_grid(left: float, right: float, spacing: float) -> Array:
    """Return a periodic grid with an absorbing layer at its left end."""
    from scipy.fft import next_fast_len

    count = next_fast_len(math.ceil((SPONGE + left + right) / spacing), real=True)
    return spacing * np.arange(count) - left - SPONGE


def carried(
    x: Array,
    front: Array,
    variable: float,
    power: int,
    time: float,
    courant: float,
    frame: float = 0.0,
) -> Array:
    """Integrate a front for a time, on a grid that moves at the speed `frame`."""
    from scipy.fft import irfft, rfft, rfftfreq
    from scipy.special import erfc

    count, ik = len(x), 2j * np.pi * rfftfreq(len(x), x[1] - x[0])
    fastest = float(abs(ik[-1]))
    bell = np.exp(-((x / _WIDE) ** 2)) / (_WIDE * math.sqrt(math.pi))
    wide, slope = 0.5 * erfc(x / _WIDE), -bell
    bend = bell * (2.0 - 4.0 * x**2 / _WIDE**2) / _WIDE**2
    if front[-1] > 0.5:
        wide, slope, bend = 1.0 - wide, -slope, -bend
    source = rfft((frame - variable * wide**power) * slope - bend / 3.0)
    flux = -variable / (power + 1) * ik
    wide_flux = wide ** (power + 1)

    def rest(modes: Modes) -> Modes:
        part = irfft(modes, count)
        return flux * rfft((part + wide) ** (power + 1) - wide_flux) + source

    rate = max(variable * _TALLEST**power * fastest / courant, _DAMPING * fastest**2)
    steps = math.ceil(time * rate)
    depth = np.clip((x[0] + SPONGE - x) / SPONGE, 0.0, 1.0)
    damping = np.exp(-time / steps * _DAMPING * fastest**2 * np.sin(np.pi * depth) ** 2)
    step = _ExponentialStep(-(ik**3) / 3.0 + frame * ik, time / steps)
    kept = np.exp(-_FILTER * (np.abs(ik) / fastest) ** _FILTER_ORDER)
    modes = rfft(front - wide)
    for _ in range(steps):
        modes = kept * rfft(irfft(step(modes, rest), count) * damping)
    return irfft(modes, count) + wide


class _ExponentialStep:
    """
    ETDRK4 of S. M. Cox and P. C. Matthews, J. Comput. Phys. 176, 430 (2002).

    The formulas of the coefficients lose digits at small rates. The coefficients are therefore
    means over a circle in the complex plane, after A.-K. Kassam and L. N. Trefethen, SIAM J. Sci.
    Comput. 26, 1214 (2005).
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
        """Return the modes one step later; `rest` computes the nonlinear terms."""
        half, middle = self._half, self._middle
        start = rest(modes)
        one = half * modes + middle * start
        rest_one = rest(one)
        rest_two = rest(half * modes + middle * rest_one)
        three = half * one + middle * (2.0 * rest_two - start)
        ended = self._whole * modes + self._first * start
        return ended + self._second * (rest_one + rest_two) + self._third * rest(three)


def main() -> None:
    """Add the points that the table lacks, as soon as they are computed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--variables", type=float, nargs="+", help="values of y")
    parser.add_argument("--order", type=int, choices=sorted(VARIABLES), default=3)
    arguments = parser.parse_args()
    order = arguments.order
    with growing_table(TABLE, HEADER) as (rows, add):
        known = {(row[0], row[1]) for row in rows}
        for variable in arguments.variables or VARIABLES[order]:
            if (str(order), str(variable)) in known:
                continue
            found = spectral_minima(variable, order)
            add([order, variable, *(f"{x:.6f}" for x in each)] for each in found)


if __name__ == "__main__":
    main()
