r"""
Front of a slow long chain, which moves from the wall to the free end and back, and the loss.

The lowest anharmonic order of the bonds is r. Positions are relative to the linear front, in units
of :math:`n^{1/3}/2` bonds. Times are in units of n, and speeds in units of v0. The front obeys an
equation of Korteweg-de Vries type,

.. math:: \partial_T U + y\, U^{r-2} \partial_X U + \tfrac13 \partial_X^3 U = 0, \qquad
          |y| = r (r - 1) |c|\, v_0^{r-2} n^{2/3},

and starts as a step at T = 0. The variable y is positive if compression stiffens the bond. At T = 1
the free end turns U into W = 1 - U, which returns to the wall by the same equation. The chain
leaves the wall when the impulse from the wall is largest. The derivation is in
``docs/explanation/slow_chains.md``.
"""

import math
from dataclasses import dataclass

import numpy as np

from chaincor.lammps_inputs.arrays import Array

# Spacings of the three grids, in widths of the narrowest soliton.
_SPACINGS = (0.1, 0.12, 0.14)
# Width of the smoothed step, in grid spacings, and power of the width in the smoothing error.
_SMOOTH, _SMOOTHING_ORDER = 2.5, 3
# Time step, times the largest rate. The classical Runge-Kutta method is stable up to 2.8.
_STABLE = 0.8 * 2.8
# Lengths ahead of the train of waves, behind the train, and of the absorbing layer, in widths of
# the linear front.
_AHEAD, _BEHIND, _SPONGE = 14.0, 12.0, 10.0
# Further lengths behind the train, in widths of solitons, for the waves that the smoothed step
# makes.
_BEHIND_WAVES, _SPONGE_WAVES = 60.0, 40.0
_REAR = 0.3
# Number of stages in which the integrated part of the grid grows with the front.
_STAGES = 40


@dataclass(frozen=True)
class FrontMinimum:
    """Local minimum of the missing impulse: 2 n v0 minus the impulse from the wall."""

    place: float  #: X of the point in the front that arrives at the wall at this minimum.
    loss: float  #: Loss :math:`n^{2/3} (1 - \\eta)` of a chain that leaves at this minimum.
    #: Bound on the error of `loss`: the difference between two extrapolations, but at least a
    #: quarter of the first correction.
    error: float


@dataclass(frozen=True)
class FrontLoss:
    r"""Loss of a chain in the limit of long chains."""

    variable: float  #: The variable y, negative if compression softens the bond.
    order: int  #: Lowest anharmonic order r.
    #: One minimum for each wave at the head of the train, beginning with the deepest minimum.
    minima: tuple[FrontMinimum, ...]

    @property
    def loss(self) -> float:
        r""":math:`n^{2/3} (1 - \eta)`; y C'(y) for cubic bonds."""
        return self.minima[0].loss

    @property
    def error(self) -> float:
        """Error of the loss due to the grid."""
        return self.minima[0].error


def front_loss(variable: float, order: int = 3, refinement: float = 1.0) -> FrontLoss:
    """
    Return the loss of slow long chains, extrapolated from three resolutions.

    Parameters
    ----------
    variable : float
        y: 0 for harmonic bonds, positive if compression stiffens the bond, negative if it softens
        the bond.
    order : int
        Lowest anharmonic order r: 3 or 4, or 5 with less certainty. From r = 6 on, solutions of the
        equation may become singular.
    refinement : float
        Factor by which the grids are finer than by default.

    Returns
    -------
    FrontLoss
        Minima of the loss, with errors. The cost is proportional to y^3.

    Raises
    ------
    ValueError
        If the variable is not finite, or the order is not 3 to 5.
    """
    if not math.isfinite(variable) or order not in (3, 4, 5):
        raise ValueError(
            f"The variable is {variable} and the order is {order}. Give a finite variable and "
            "order 3 to 5."
        )
    grids = [Grid(variable, order - 2, part / refinement) for part in _SPACINGS]
    fine, *rougher = (grid.minima() for grid in grids)
    ratios = [rough.spacing / grids[0].spacing for rough in grids[1:]]
    minima = []
    for place, loss in fine:
        nearest = [min(found, key=lambda other: abs(other[0] - place))[1] for found in rougher]
        minima.append(_extrapolated(place, [loss, *nearest], ratios))
    return FrontLoss(variable, order, tuple(sorted(minima, key=lambda found: found.loss)))


def _extrapolated(place: float, losses: list[float], ratios: list[float]) -> FrontMinimum:
    """Extrapolate the losses on three grids by Richardson's rule."""
    near, far = (ratio**_SMOOTHING_ORDER for ratio in ratios)
    first = (losses[0] - losses[1]) / (near - 1.0)
    rough = (losses[1] - losses[2]) / (far / near - 1.0)
    loss = losses[0] + first
    error = max(abs(loss - (losses[1] + rough)), 0.25 * abs(first))
    return FrontMinimum(place, loss, error)


class Grid:
    """
    Grid that moves with the linear front, and the front on this grid.

    Parameters
    ----------
    variable : float
        y.
    power : int
        r - 2.
    spacing : float
        Distance between grid points, in widths of the narrowest soliton.
    """

    def __init__(self, variable: float, power: int, spacing: float) -> None:
        from chaincor.analysis.slow_chains.front_steps import antisymmetric_weights, largest_rate

        self._y, self._power = variable, power
        steep = abs(variable)
        wave = 1.0 / math.sqrt(max(1.0, 0.5 * steep))
        self.spacing = spacing * wave
        self._sponge_length = _SPONGE + _SPONGE_WAVES * wave
        # If bonds stiffen, the head of the train is at X = 2 y/3 at the free end. Back at the wall,
        # it is at most y farther, because no wave is faster than y. The rear half of the train is
        # not needed, because it cannot reach the point near X = y at which the chain leaves the
        # wall. If bonds soften, the train begins at X = -2 |y|.
        behind = (_REAR if variable > 0.0 else 2.2) * steep + _BEHIND + _BEHIND_WAVES * wave
        ahead = (1.75 if variable > 0.0 else 0.3) * steep + _AHEAD
        self._left = -behind
        left = math.ceil((behind + self._sponge_length) / self.spacing)
        self.x = self.spacing * np.arange(-left, math.ceil(ahead / self.spacing) + 1)
        depth = np.clip((self._left - self.x) / self._sponge_length, 0.0, 1.0)
        # The smoothed step has wave numbers up to 3.5/width. The speed of a wave is the square of
        # its wave number.
        fastest = (3.5 / (_SMOOTH * self.spacing)) ** 2
        self._sponge = 30.0 * fastest / self._sponge_length * np.sin(0.5 * np.pi * depth) ** 2
        first, third = antisymmetric_weights(1), antisymmetric_weights(3)
        self._flux = variable / (power + 1) / self.spacing * first
        self._spread = third / 3.0 / self.spacing**3
        rate = largest_rate(self._spread) + 2.0**power * (power + 1) * largest_rate(self._flux)
        self._steps = math.ceil(rate / _STABLE)

    def minima(self) -> list[tuple[float, float]]:
        """Integrate the front to the free end and back; return X and loss of each local minimum."""
        from scipy.integrate import cumulative_simpson
        from scipy.interpolate import CubicSpline

        steep = max(0.0, self._y)
        front = self._carried(self._step(), 1.0, (0.0, 2.0 * steep / 3.0))
        back = self._carried(1.0 - front, 0.0, (2.0 * steep / 3.0, 5.0 * steep / 3.0))
        # Impulse that the wall has not yet given when the point x of the front arrives at the wall.
        missing = cumulative_simpson(2.0 * (1.0 - back)[::-1], dx=self.spacing, initial=0.0)[::-1]
        deficit = self.x + missing
        inside = (deficit[1:-1] < deficit[:-2]) & (deficit[1:-1] <= deficit[2:])
        lowest = np.flatnonzero(inside & (self.x[1:-1] > self._left)) + 1
        plateau = 2.0 * self._y / (self._power + 1)
        found = []
        for least in lowest:
            near = slice(least - 4, least + 5)
            spline = CubicSpline(self.x[near], deficit[near])
            places = spline.derivative().roots(extrapolate=False)
            place = places[np.argmin(spline(places))]
            found.append((float(place), float(spline(place)) - plateau))
        return found

    def _step(self) -> Array:
        """Return the step, smoothed by a kernel whose moments 1 to 5 vanish."""
        from scipy.special import erfc

        z = self.x / (_SMOOTH * self.spacing)
        bell = np.exp(-(z**2)) / math.sqrt(math.pi)
        return 0.5 * erfc(z) + bell * (z**3 / 4.0 - 7.0 * z / 8.0)

    def _carried(self, front: Array, level: float, heads: tuple[float, float]) -> Array:
        """Integrate a front for the time 1; `level` is u far behind, `heads` encloses its head."""
        from chaincor.analysis.slow_chains.front_steps import REACH, compiled_steps

        advance = compiled_steps(self._power)
        carried, done = front.copy(), 0
        for stage in range(1, _STAGES + 1):
            head = heads[0] + (heads[1] - heads[0]) * stage / _STAGES + _AHEAD - 1.0
            last = min(int(np.searchsorted(self.x, head)), len(front) - REACH)
            steps = self._steps * stage // _STAGES - done
            advance(
                *(carried, steps, 1.0 / self._steps, REACH, last),
                *(self._flux, self._spread, self._sponge, level),
            )
            done += steps
        return carried
