r"""
The front that a wall sends into a slow long chain, to its free end and back, and its loss.

With r the bond's lowest anharmonic order, lengths in :math:`n^{1/3}/2` bonds around the front,
times in n and speeds in v0 the front obeys an equation of Korteweg and de Vries' kind,

.. math:: U_T + y\, U^{r-2} U_X + \tfrac13 U_{XXX} = 0, \qquad
          |y| = r (r - 1) |c|\, v_0^{r-2} n^{2/3},

from a step at T = 0; y > 0 where compression stiffens the bond. At T = 1 the free end turns U into
W = 1 - U, which comes back by the same equation. The chain leaves where the impulse of the wall is
largest. Derived in ``docs/explanation/slow_chains.md``.
"""

import math
from dataclasses import dataclass

import numpy as np

from chaincor.lammps_inputs.arrays import Array

# Spacings of the three grids, in widths of the narrowest soliton.
_SPACINGS = (0.1, 0.12, 0.14)
# The step is smooth over so many spacings; smoothing errs by the third power of its width.
_SMOOTH, _SMOOTHING_ORDER = 2.5, 3
# Part of the largest stable step of the classical Runge-Kutta method, 2.8 over the rate.
_STABLE = 0.8 * 2.8
# Lengths beside the train of waves, in widths of the linear front: ahead, behind, sponge.
_AHEAD, _BEHIND, _SPONGE = 14.0, 12.0, 10.0
# The same in widths of solitons, in which waves run that the step itself makes.
_BEHIND_WAVES, _SPONGE_WAVES = 60.0, 40.0
_REAR = 0.3
# The window of the grid grows with the front in so many stages.
_STAGES = 40


@dataclass(frozen=True)
class Minimum:
    """A local minimum of the impulse that the wall has not given."""

    place: float  #: X of the front's place that arrives then.
    loss: float  #: What the chain would lose if it left then, as :math:`n^{2/3} (1 - \\eta)`.
    error: float  #: Change by the last extrapolation, and at least a quarter of the first.


@dataclass(frozen=True)
class FrontLoss:
    r"""Loss of a chain in the limit of long chains."""

    variable: float  #: y; below 0 where compression softens the bond.
    order: int  #: r.
    minima: tuple[Minimum, ...]  #: The deepest first; one for each wave at the head of the train.

    @property
    def loss(self) -> float:
        r""":math:`n^{2/3} (1 - \eta)`; y C'(y) for cubic bonds."""
        return self.minima[0].loss

    @property
    def error(self) -> float:
        """The error of the loss by the grid."""
        return self.minima[0].error


def front_loss(variable: float, order: int = 3, refinement: float = 1.0) -> FrontLoss:
    """
    Return the loss of slow long chains, extrapolated from three resolutions.

    Parameters
    ----------
    variable : float
        y: 0 for harmonic bonds, positive where compression stiffens the bond, else negative.
    order : int
        Lowest anharmonic order r: 3 or 4, and 5 with less certainty. From 6 on fronts of such
        equations may become singular.
    refinement : float
        By which the usual grids are finer.

    Returns
    -------
    FrontLoss
        Its cost grows as y^3: a second at y = 5, two a minute at 40.

    Raises
    ------
    ValueError
        For a variable that is not finite, or an order that is not 3 to 5.
    """
    if not math.isfinite(variable) or order not in (3, 4, 5):
        raise ValueError(
            f"Variable {variable}, order {order} given. Give a finite variable and order 3 to 5."
        )
    grids = [Grid(variable, order - 2, part / refinement) for part in _SPACINGS]
    fine, *rougher = (grid.minima() for grid in grids)
    ratios = [rough.spacing / grids[0].spacing for rough in grids[1:]]
    minima = []
    for place, loss in fine:
        nearest = [min(found, key=lambda other: abs(other[0] - place))[1] for found in rougher]
        minima.append(_extrapolated(place, [loss, *nearest], ratios))
    return FrontLoss(variable, order, tuple(sorted(minima, key=lambda found: found.loss)))


def _extrapolated(place: float, losses: list[float], ratios: list[float]) -> Minimum:
    """Extrapolate the finest of three losses by Richardson's rule."""
    near, far = (ratio**_SMOOTHING_ORDER for ratio in ratios)
    first = (losses[0] - losses[1]) / (near - 1.0)
    rough = (losses[1] - losses[2]) / (far / near - 1.0)
    loss = losses[0] + first
    error = max(abs(loss - (losses[1] + rough)), 0.25 * abs(first))
    return Minimum(place, loss, error)


class Grid:
    """
    One grid and the front on it.

    Parameters
    ----------
    variable : float
        y.
    power : int
        r - 2.
    spacing : float
        Distance of grid points, in widths of the narrowest soliton.
    """

    def __init__(self, variable: float, power: int, spacing: float) -> None:
        from chaincor.analysis.slow_chains.front_steps import antisymmetric_weights, largest_rate

        self._y, self._power = variable, power
        steep = abs(variable)
        wave = 1.0 / math.sqrt(max(1.0, 0.5 * steep))
        self.spacing = spacing * wave
        self._sponge_length = _SPONGE + _SPONGE_WAVES * wave
        # Stiffening: the train ends at 2 y/3, then at most y further, and nothing of it runs faster
        # than y, so that its rear half cannot come up to the place near y where the chain leaves.
        # Softening: the train begins at -2 |y|.
        behind = (_REAR if variable > 0.0 else 2.2) * steep + _BEHIND + _BEHIND_WAVES * wave
        ahead = (1.75 if variable > 0.0 else 0.3) * steep + _AHEAD
        self._left = -behind
        left = math.ceil((behind + self._sponge_length) / self.spacing)
        self.x = self.spacing * np.arange(-left, math.ceil(ahead / self.spacing) + 1)
        depth = np.clip((self._left - self.x) / self._sponge_length, 0.0, 1.0)
        # The smoothed step has waves up to 3.5 over its width, which run at their square.
        fastest = (3.5 / (_SMOOTH * self.spacing)) ** 2
        self._sponge = 30.0 * fastest / self._sponge_length * np.sin(0.5 * np.pi * depth) ** 2
        first, third = antisymmetric_weights(1), antisymmetric_weights(3)
        self._flux = variable / (power + 1) / self.spacing * first
        self._spread = third / 3.0 / self.spacing**3
        rate = largest_rate(self._spread) + 2.0**power * (power + 1) * largest_rate(self._flux)
        self._steps = math.ceil(rate / _STABLE)

    def minima(self) -> list[tuple[float, float]]:
        """Send the front out and back and return place and loss where the wall's push ends."""
        from scipy.integrate import cumulative_simpson
        from scipy.interpolate import CubicSpline

        steep = max(0.0, self._y)
        front = self._carried(self._step(), 1.0, (0.0, 2.0 * steep / 3.0))
        back = self._carried(1.0 - front, 0.0, (2.0 * steep / 3.0, 5.0 * steep / 3.0))
        # What the wall has not given until the place x of the front arrives.
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
        """Return the step, smooth by a kernel whose moments 1 to 5 vanish."""
        from scipy.special import erfc

        z = self.x / (_SMOOTH * self.spacing)
        bell = np.exp(-(z**2)) / math.sqrt(math.pi)
        return 0.5 * erfc(z) + bell * (z**3 / 4.0 - 7.0 * z / 8.0)

    def _carried(self, front: Array, level: float, heads: tuple[float, float]) -> Array:
        """Carry a front for the time 1, behind which is the level, with its head from and to."""
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
