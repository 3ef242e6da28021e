"""How long a run of Verlet steps needs no look at the wall."""

import math

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential


class BlindBound:
    r"""
    How long particle 1 can probably be left alone because it does not reach the wall.

    With strain s of bond 1, its opening speed w and k = U''(s), particle 1 moves as

    .. math:: x + v t + a t^2/2 + k w t^3/6 + [k (a_2 - a) + k' w^2] t^4/24 + O(t^5),

    and its fifth derivative is :math:`k^2 (w_2 - 2 w) + 3 k' w (a_2 - a) + k'' w^3`, in which the
    speeds grow with the accelerations. The remainder is taken as `SAFETY` times the sum of the
    sizes of these terms as they are now.

    That is no theorem: particles further on may hit these, and bonds stiffen. Nothing rests on it
    but the number of runs that have to be taken back. LAMMPS watches every step of them, see
    :class:`chaincor.workflows.engines.lammps.guard.WallGuard`.

    Parameters
    ----------
    bond : Potential
        The bonds' potential.
    bond_range : tuple of float
        Lengths between which curvatures are tabulated; beyond, the nearest is used.
    """

    SAFETY = 1.5  # without it, remainders reach 1.2 of the bound in some scenes, and 0.7 in most
    LONGEST = 2.0  # in units of 1/sqrt(k): further than that the series says nothing
    _ROWS = 4001
    # A zero is looked for in parts of this length at first, no more of them than that.
    _FIRST_PART = 0.5
    _MOST_PARTS = 12
    _CLOSE = 0.02

    def __init__(self, bond: Potential, bond_range: tuple[float, float]) -> None:
        lengths = np.linspace(*bond_range, self._ROWS)
        curvatures = bond.curvature(lengths - 1.0)
        slopes = np.gradient(curvatures, lengths)
        self._first = float(bond_range[0])
        self._per_length = (self._ROWS - 1) / float(bond_range[1] - bond_range[0])
        self._derivatives = list(
            zip(
                curvatures.tolist(),
                slopes.tolist(),
                np.abs(np.gradient(slopes, lengths)).tolist(),
                strict=True,
            )
        )

    def _at(self, length: float) -> tuple[float, float, float]:
        """Return k, k' and the size of k'' of a bond."""
        place = (length - self._first) * self._per_length
        if 0.0 < place < self._ROWS - 1:
            row = round(place)
            curvature, slope, bend = self._derivatives[row]
            return curvature + slope * (place - row) / self._per_length, slope, bend
        # Beyond the table, and for a length that is no number.
        return self._derivatives[-1 if place > 0.0 else 0]

    def look(
        self,
        x: NDArray[np.float64],
        v: NDArray[np.float64],
        f: NDArray[np.float64],
        timestep: float,
    ) -> None:
        """
        Take in the state of the first three particles.

        The Verlet step's own error, h^2 t/12 times higher derivatives, is part of the bound three
        times over.
        """
        x1, x2, *further = x[:3].tolist()
        v1, v2, *v3 = v[:3].tolist()
        a1, a2, *a3 = f[:3].tolist()
        opening, pull = v2 - v1, abs(a1) + abs(a2)
        curvature, slope, bend = self._at(x2 - x1)
        stiffness, speed, beyond_speed = abs(curvature), abs(opening), 0.0
        if further:
            pull += abs(a3[0])
            beyond_speed = abs(v3[0] - v2)
            stiffness = max(stiffness, abs(self._at(further[0] - x2)[0]))
        t = self.LONGEST / math.sqrt(max(stiffness, 0.25))
        # What grows as t counts a sixth: t^6/720 is t^5/120 times t/6.
        fifth = stiffness**2 * (2.0 * speed + beyond_speed + 0.5 * pull * t)
        fifth += 3.0 * abs(slope) * speed * pull + bend * speed**3
        self._timestep, self._longest = timestep, t
        self._position, self._velocity, self._half_force = x1, v1, 0.5 * a1
        self._jerk = curvature * opening / 6.0
        self._snap = (curvature * (a2 - a1) + slope * opening**2) / 24.0
        self._remainder = self.SAFETY * fifth / 120.0
        # The step's own error, three times over: a quarter of h^2 x^(3) t and of h^2 x^(4) t^2.
        own = 1.5 * timestep * timestep
        self._linear = own * abs(self._jerk)
        self._square = own * (abs(self._snap) + self._remainder * t)

    def safe_time(self, wall: float = 0.0) -> float:
        r"""
        Return a time within which the bound does not come to the wall.

        The bound P is followed from left to right: where :math:`P'' \ge -M` up to some time ahead,
        :math:`P(t + \tau) \ge P(t) + P'(t) \tau - M \tau^2/2`, so that going on to the root of this
        parabola never passes a zero of P. These steps close in on a zero as Newton's do, and pass
        over a minimum in front of the wall.

        A particle that leaves the wall may not yet be in front of it. The first step is known
        exactly: if it ends there, P is followed from its end.

        The result is at most the time of P's first zero; 0 where particle 1 is not in front of the
        wall, and not after one step that leaves it either.
        """
        c0, c3, c4, c5 = self._position - wall, self._jerk, self._snap, -self._remainder
        c1, c2 = self._velocity - self._linear, self._half_force - self._square
        d2, d3, d4, d5 = 2.0 * c2, 3.0 * c3, 4.0 * c4, 5.0 * c5
        longest = self._longest
        start = 0.0
        if c0 <= 0.0:
            start = self._timestep
            end = c0 + start * (self._velocity + start * self._half_force)
            if self._velocity <= 0.0 or end <= 0.0 or start >= longest:
                return 0.0
        t, ahead = start, self._FIRST_PART * longest
        for _ in range(self._MOST_PARTS):
            value = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
            slope = c1 + t * (d2 + t * (d3 + t * (d4 + t * d5)))
            if not value > 0.0:  # also if it is no number
                break
            end = t + ahead
            if end > longest:
                end = longest
            # M, from the least value of each term of P'' between t and the end.
            fall = -d2 - 2.0 * d3 * (end if d3 < 0.0 else t)
            fall -= 3.0 * d4 * (end * end if d4 < 0.0 else t * t) + 4.0 * d5 * end * end * end
            if fall < 0.0:
                fall = 0.0
            root = math.sqrt(slope * slope + 2.0 * fall * value)
            if slope < 0.0:
                step = 2.0 * value / (root - slope)
            else:
                step = (root + slope) / fall if fall > 0.0 else longest
            if not t + step >= end:
                t += step
                if step < self._CLOSE * t:
                    break
            elif end == longest:
                return longest
            else:
                t, ahead = end, 2.0 * ahead
        return t if t > start else 0.0
