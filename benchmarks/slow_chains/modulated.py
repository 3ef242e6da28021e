r"""
Compute steep fronts that start as a modulated wave at the free end, not as a step.

    python -m benchmarks.slow_chains.modulated [--variables Y ...]

Adds the missing values of y to ``modulated.csv`` in this folder: the deepest minima of the loss on
two grids. Only the way from the free end back to the wall is computed, by the Fourier modes of
``spectral``.

In units of the equation u_t + 6 u u_x + u_xxx = 0 the train of a step is

.. math:: u = 2\,\mathrm{dn}^2(K \Phi/\pi, m) - (1 - m), \qquad
          \Phi = \frac{\pi}{K} \left[x - 2 (1 + m) t\right] + \pi - \frac{I}{K}, \qquad
          I(m) = \int_{\sqrt m}^1 \frac{\ln(4 k \sqrt{1 - k^2})\,dk}{\sqrt{(1 - k^2)(k^2 - m)}}

with the complete integral K(m), and m(x, t) from :math:`\partial \Phi/\partial m = 0`. The train of
Gurevich and Pitaevskii has I = 0. The term I is the phase of Egorova and others (Nonlinearity 26,
1839, 2013). Its logarithm contains the jump of the step's reflection coefficient at the wave number
i k. The constants were checked with the front of `spectral`.
"""

import argparse
import math
from pathlib import Path

import numpy as np

from benchmarks.slow_chains.growing_table import growing_table
from benchmarks.slow_chains.spectral import SPONGE, carried, front_grid, minima
from chaincor.lammps_inputs.arrays import Array

TABLE = Path(__file__).with_name("modulated.csv")
HEADER = ["variable", "spacing", "place", "loss"]
VARIABLES = [60.0, 100.0, 120.0, 160.0, 240.0, 320.0]
# Spacings in widths of the leading soliton, and time steps times the rate of the steepest front.
GRIDS = ((0.36, 1.25), (0.3, 1.0))
# Fraction and largest length of the train that is kept, and lengths behind and ahead, in widths of
# the linear front.
_REAR, _LONGEST_REAR, _BEHIND, _AHEAD = 0.3, 18.0, 12.0, 13.0
# Number of minima of the table for each y and grid.
_MINIMA = 6


def modulated_wave(x: Array, time: float) -> Array:
    """
    Return the wave train of a step that started at x = 0.

    Parameters
    ----------
    x : numpy.ndarray
        Increasing positions, in units of the equation u_t + 6 u u_x + u_xxx = 0.
    time : float
        Time since the step, much longer than 1.

    Returns
    -------
    numpy.ndarray
        u. Ahead of the first crest, u is the tail of a soliton.
    """
    from scipy.interpolate import make_interp_spline
    from scipy.special import ellipe, ellipj, ellipkm1

    # Values of 1 - m, because the leading solitons have m close to 1.
    rest = np.exp(np.linspace(math.log(1e-12), math.log(0.5), 4000))
    rest = np.concatenate([rest, 1.0 - np.geomspace(0.5, 1e-4, 2000)[1:]])
    m, k = 1.0 - rest, ellipkm1(rest)
    gap = ellipe(m) - rest * k
    phase, slope = _phase_integral(rest)
    # At the position of m, the derivative of Phi with respect to m is 0.
    place = time * (2.0 * (1.0 + m) - 4.0 * m * rest * k / gap)
    place += (phase - slope * k * 2.0 * m * rest / gap) / math.pi
    order = np.argsort(place)
    order = order[np.diff(place[order], prepend=-np.inf) > 1e-9]
    known = place[order]
    here = np.clip(x, known[0], known[-1])
    rest_here = np.exp(make_interp_spline(known, np.log(rest[order]), k=3)(here))
    phase_here = make_interp_spline(known, phase[order], k=3)(here)
    k_here = ellipkm1(rest_here)
    argument = x - 2.0 * (2.0 - rest_here) * time + k_here - phase_here / math.pi
    dn = ellipj(argument, 1.0 - rest_here)[2]
    wave = 2.0 * dn**2 - rest_here
    # Crests are at multiples of the period 2 K. Ahead of the first crest the wave is a soliton.
    periods = (argument / (2.0 * k_here))[x < known[-1]]
    last = np.flatnonzero(np.diff(np.floor(periods)) != 0.0)[-1]
    crest = np.interp(math.ceil(periods[last]), periods[last : last + 2], x[last : last + 2])
    height = 2.0 - float(np.interp(crest, x, rest_here))
    distance = np.clip(math.sqrt(0.5 * height) * (x - crest), 0.0, 50.0)
    return np.where(x > crest, height / np.cosh(distance) ** 2, wave)


def _phase_integral(rest: Array) -> tuple[Array, Array]:
    """Return the integral I and its derivative with respect to m, for an array of 1 - m."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    angles, weights = (nodes + 1.0) * math.pi / 4.0, weights * math.pi / 4.0
    # With k^2 = 1 - (1 - m) sin^2, the integral of ln sin is known, and the remaining integrand is
    # smooth.
    total = np.full_like(rest, -0.5 * math.pi * math.log(2.0))
    slope = np.zeros_like(rest)
    for sine, weight in zip(np.sin(angles), weights, strict=True):
        square = 1.0 - rest * sine**2
        over = 1.0 / np.sqrt(square)
        level = np.log(4.0 * np.sqrt(square * rest))
        total += weight * (level * over + math.log(sine) * (over - 1.0))
        slope += weight * over * (0.5 * sine**2 / square - 0.5 / rest)
        slope -= weight * 0.5 * sine**2 * over**3 * (level + math.log(sine))
    return total, slope


def modulated_minima(
    variable: float, spacing: float = 0.3, courant: float = 1.0
) -> list[tuple[float, float]]:
    """
    Return position and loss of the deepest minima of the loss, beginning with the deepest.

    Parameters
    ----------
    variable : float
        y of cubic bonds, at least 60.
    spacing, courant : float
        Spacing in widths of the leading soliton, and time step times the rate of the steepest
        front.
    """
    x, scale = modulated_grid(variable, spacing), math.sqrt(0.5 * variable)
    return way_back(x, modulated_wave(x * scale, scale**3 / 3.0), variable, courant)


def modulated_grid(variable: float, spacing: float) -> Array:
    """Return the grid around the front at the free end, for a spacing in soliton widths."""
    rear = min(_REAR * variable, _LONGEST_REAR)
    width = 1.0 / math.sqrt(0.5 * variable)
    return front_grid(rear + _BEHIND, 2.0 * variable / 3.0 + _AHEAD, spacing * width)


def way_back(x: Array, front: Array, variable: float, courant: float) -> list[tuple[float, float]]:
    """Return position and loss of the deepest minima, from the front at the free end."""
    # In the absorbing layer, the wave changes smoothly to its level behind the train.
    depth = np.clip((x - x[0]) / SPONGE, 0.0, 1.0)
    front = 1.0 + (front - 1.0) * (depth - np.sin(2.0 * np.pi * depth) / (2.0 * np.pi))
    back = carried(x, 1.0 - front, variable, 1, 1.0, courant, frame=variable)
    inside = x > x[0] + SPONGE
    return minima((x + variable)[inside], back[inside], variable, 3)[:_MINIMA]


def main() -> None:
    """Add the points that the table lacks, as soon as they are computed."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--variables", type=float, nargs="+", default=VARIABLES, help="values of y")
    arguments = parser.parse_args()
    with growing_table(TABLE, HEADER) as (rows, add):
        known = {(row[0], row[1]) for row in rows}
        for variable in arguments.variables:
            for spacing, courant in GRIDS:
                if (str(variable), str(spacing)) in known:
                    continue
                minima_found = modulated_minima(variable, spacing, courant)
                add([variable, spacing, f"{x:.6f}", f"{loss:.6f}"] for x, loss in minima_found)


if __name__ == "__main__":
    main()
