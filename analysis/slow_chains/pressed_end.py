r"""
The end of a half-infinite harmonic chain that a wall stops, from contact to contact.

Particle 1 of a half-infinite chain at rest that gets the momentum 1 is after the time t at

.. math:: R(t) = \int_0^t \frac{J_1(2\tau)}{\tau} d\tau
               = 1 - \frac{1}{\pi} \mathrm{Re} \int_0^\infty
                 \frac{\sqrt{u} \sqrt{4i - u}}{2i - u} e^{(2i - u) t} du,

the second form from the cut of the Laplace transform :math:`(\sqrt{s^2 + 4} - s)/2`.
Units: mass, stiffness and impact speed 1.
"""

import math
from typing import Protocol

import numpy as np

# u = exp(z) in steps of 0.3: the error of the trapezoidal rule is exp(-pi^2/0.3) = 5e-15, as the
# nearest singularity is at Im z = pi/2. Ends: u^1.5 = 1e-17, and exp(-u t) = 1e-18 at _SOONEST.
_SOONEST = 0.05
_Z = np.arange(math.log(5e-12), math.log(42.0 / _SOONEST), 0.3)
_U = np.exp(_Z)
_RATES = 2j - _U
_WEIGHTS = -0.3 * _U**1.5 * np.sqrt(4j - _U) / (math.pi * _RATES)
# Steady contacts are 2.1 to 2.5 apart and come after one arch; moments to look at between them.
_ARCH = np.arange(1.0, 3.0, 0.25)
_TURNS = np.exp(_ARCH[:, None] * _RATES)
# While the push ends particle 1 may hit the wall softly and soon again.
_LOOK = 0.1


class PressedEnd:
    """
    Particle 1 of a half-infinite chain that a wall stops: its contacts, one by one.

    Attributes
    ----------
    times, momenta : list of float
        When particle 1 hit the wall, and the momentum 2 v of each contact.
    """

    def __init__(self) -> None:
        self.times, self.momenta = [0.0], [2.0]
        self._surplus = 2.0
        self._state = 2.0 * _WEIGHTS

    def branch(self) -> "PressedEnd":
        """
        Return an end that goes on independently.

        Returns
        -------
        PressedEnd
            In the same state.
        """
        other = PressedEnd()
        other.times, other.momenta = self.times.copy(), self.momenta.copy()
        other._surplus, other._state = self._surplus, self._state.copy()
        return other

    @property
    def surplus(self) -> float:
        """The momentum that the wall gave, less the time: what the front is ahead by."""
        return self._surplus

    def next_contact(self, echo: "Echo | None" = None, until: float = math.inf) -> bool:
        """
        Fly to the next contact and carry it out.

        Parameters
        ----------
        echo : Echo, optional
            What comes back from the free end.
        until : float
            When to stop looking.

        Returns
        -------
        bool
            Whether there was one.
        """
        bracket = self._arch() if echo is None else self._search(echo, until - self.times[-1])
        if bracket is None or self.times[-1] + bracket[0] > until:
            return False
        flown = self._root(*bracket, echo)
        momentum = -2.0 * self._motion(flown, echo)[1]
        self._state = self._state * np.exp(_RATES * flown) + momentum * _WEIGHTS
        self._surplus += momentum - flown
        self.times.append(self.times[-1] + flown)
        self.momenta.append(momentum)
        return True

    def _arch(self) -> tuple[float, float]:
        """Return moments before and after x = 0 of steady contacts."""
        places = self._surplus - _ARCH + (_TURNS @ self._state).real
        first = int(np.argmax(places <= 0.0))
        assert first > 0, "steady contacts are more than 1 and less than 2.75 apart"
        return float(_ARCH[first - 1]), float(_ARCH[first])

    def _search(self, echo: "Echo", longest: float) -> tuple[float, float] | None:
        """Return moments before and after the first x = 0, or None."""
        early = _SOONEST
        place, speed = self._motion(early, echo)
        if place <= 0.0:
            raise ArithmeticError(f"contacts at {self.times[-1]} are less than {early} apart")
        while early < longest:
            late = early + _LOOK
            place, later_speed = self._motion(late, echo)
            if place <= 0.0:
                return early, late
            if speed < 0.0 < later_speed:
                lowest = self._lowest(early, late, echo)
                if self._motion(lowest, echo)[0] <= 0.0:
                    return early, lowest
            early, speed = late, later_speed
        return None

    def _lowest(self, early: float, late: float, echo: "Echo") -> float:
        """Return when particle 1 turns back, by bisection."""
        for _ in range(40):
            middle = 0.5 * (early + late)
            if self._motion(middle, echo)[1] < 0.0:
                early = middle
            else:
                late = middle
        return late

    def _motion(self, flown: float, echo: "Echo | None") -> tuple[float, float]:
        """Return x and its rate so long after the last contact."""
        turned = self._state * np.exp(_RATES * flown)
        place = self._surplus - flown + float(turned.sum().real)
        speed = -1.0 + float((_RATES * turned).sum().real)
        if echo is not None:
            back, rate = echo.of(self.times[-1] + flown, self.times, self.momenta)
            place, speed = place + back, speed + rate
        return place, speed

    def _root(self, early: float, late: float, echo: "Echo | None") -> float:
        """Return where x falls through zero, by Newton's steps kept between two bounds."""
        before = self.times[-1] - self.times[-2] if len(self.times) > 1 else 0.0
        flown = before if early < before < late else 0.5 * (early + late)
        for _ in range(60):
            place, speed = self._motion(flown, echo)
            if place > 0.0:
                early = flown
            else:
                late = flown
            step = flown - place / speed if speed else early
            new = step if early < step < late else 0.5 * (early + late)
            if abs(new - flown) < 1e-13:
                return new
            flown = new
        return flown


class Echo(Protocol):
    """What comes back to particle 1."""

    def of(self, time: float, times: list[float], momenta: list[float]) -> tuple[float, float]:
        """Return how far it has moved particle 1, of all contacts, and its rate."""
