r"""
Collisions of long harmonic chains with a wall, from the echo of the free end.

A wall stops the end of a half-infinite chain, contact by contact. If particle 1 of a half-infinite
chain at rest receives the momentum 1, its position after the time t is

.. math:: R(t) = \int_0^t \frac{J_1(2\tau)}{\tau} d\tau
               = 1 - \frac{1}{\pi} \mathrm{Re} \int_0^\infty
                 \frac{\sqrt{u} \sqrt{4i - u}}{2i - u} e^{(2i - u) t} du,

where the second form follows from the cut of the Laplace transform
:math:`(\sqrt{s^2 + 4} - s)/2`. In a chain of n particles, mirrored at both ends, the echo is

.. math:: E_n(t) = \int_0^t \left[J_{4n-2} + 2 J_{4n} + J_{4n+2}\right](2\tau)\, d\tau,

which vanishes before t = 2n. All chains therefore have the same contacts up to about t = 2n, and
the cost of a contact does not depend on the length. The end of a collision requires only the echo
of the first contacts. Units: mass, stiffness and impact speed 1.
"""

import math
from collections.abc import Iterable, Iterator
from copy import deepcopy
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from chaincor.lammps_inputs.arrays import Array

# Computed part of the front, in widths ahead of it and behind it. The Airy function is 1e-13 at 9
# widths ahead. Chain and wall separate at 0.4 widths behind the front, where the integral F of the
# Airy function is 1/2. The gap grows as long as F exceeds 1/2, and farther behind, F stays above
# 0.8.
_BEFORE, _BEHIND = 10.0, 4.0
_PANEL_NODES = 16
# Bound on the error of eta, divided by the number of particles: three times the largest difference
# from the modal engine, for 76 lengths from 100 to 10000.
_ERROR_PER_PARTICLE = 5e-12


# The integral over u = exp(z) has steps of 0.3 in z. The nearest singularity is at Im z = pi/2, and
# the error of the trapezoidal rule is therefore exp(-pi^2/0.3) = 5e-15. The lower limit has u^1.5 =
# 1e-17, and the upper limit exp(-u t) = 1e-18 at t = _SOONEST.
_SOONEST = 0.05
_Z = np.arange(math.log(5e-12), math.log(42.0 / _SOONEST), 0.3)
_U = np.exp(_Z)
_RATES = 2j - _U
_WEIGHTS = -0.3 * _U**1.5 * np.sqrt(4j - _U) / (math.pi * _RATES)
# The interval between steady contacts is 2.1 to 2.5, and up to 3.2 if the push decreases. Between
# two contacts x rises and falls once. x is sampled at the times _ARCH after a contact.
_ARCH = np.arange(1.0, 3.6, 0.25)
_TURNS = np.exp(_ARCH[:, None] * _RATES)
# After this number of contacts, the last two intervals predict the next interval.
_REGULAR = 30
# Step in the search for the next contact near the end of the push, where slow contacts may soon
# follow each other.
_LOOK = 0.1


_Time = TypeVar("_Time", float, Array)


@dataclass(frozen=True)
class HarmonicCollision:
    """Collision of a long harmonic chain."""

    particles: int  #: Number of particles n.
    restitution: float  #: Ratio of energies, eta.
    restitution_error: float  #: Bound on the error of eta.
    contacts: int  #: Number of contacts of particle 1 with the wall.
    last_contact_time: float  #: Time from the first contact to the last.


class PressedEnd:
    """
    Motion of particle 1 in a half-infinite chain that hits a wall, and its contacts.

    `times` are the times of the contacts, and `momenta` the momentum 2 v of each contact.

    Parameters
    ----------
    decline : float
        Rate at which the push decreases from 1.
    """

    def __init__(self, decline: float = 0.0) -> None:
        self.times, self.momenta = [0.0], [2.0]
        #: Push at the last contact, and its rate of decrease.
        self.push, self._decline = 1.0, decline
        #: Lead of the front: the momentum from the wall minus the integral of the push.
        self.surplus = 2.0
        self._state = 2.0 * _WEIGHTS

    def next_contact(
        self,
        echo: "_EchoOfChain | None" = None,
        until: float = math.inf,
        steady: bool = True,
    ) -> bool:
        """
        Advance to the next contact and apply it; return whether there was a contact.

        Parameters
        ----------
        echo : _EchoOfChain, optional
            Echo of the free end.
        until : float
            Time at which the search stops.
        steady : bool
            Whether contacts without an echo are regular. If False, x is searched in small steps.
        """
        flown = self._steady_flight() if echo is None and steady else 0.0
        if not flown:
            bracket = self._search(echo, until - self.times[-1])
            if bracket is None:
                return False
            flown = self._root(*bracket, echo)
        if self.times[-1] + flown > until:
            return False
        momentum = -2.0 * self._motion(flown, echo)[1]
        self._state = self._state * np.exp(_RATES * flown) + momentum * _WEIGHTS
        self.surplus += momentum - self._pushed(flown)
        self.push -= self._decline * flown
        self.times.append(self.times[-1] + flown)
        self.momenta.append(momentum)
        return True

    def _steady_flight(self) -> float:
        """Return the time to the next of regular contacts."""
        if len(self.times) > _REGULAR:
            before, last = np.diff(self.times[-3:])
            flown = 2.0 * last - before
            for _ in range(6):
                place, speed = self._motion(flown, None)
                flown -= place / speed
                if abs(place) < 1e-12 * abs(speed) and abs(flown - last) < 0.01:
                    return float(flown)
        return self._root(*self._arch(), None)

    def _arch(self) -> tuple[float, float]:
        """Return two times that enclose the next x = 0, for steady contacts."""
        places = self.surplus - self._pushed(_ARCH) + (_TURNS @ self._state).real
        first = int(np.argmax(places <= 0.0))
        assert first > 0, "steady contacts are more than 1 and less than 3.5 apart"
        return float(_ARCH[first - 1]), float(_ARCH[first])

    def _pushed(self, flown: _Time) -> _Time:
        """Return the integral of the push over a time after the last contact."""
        return (self.push - 0.5 * self._decline * flown) * flown

    def _search(self, echo: "_EchoOfChain | None", longest: float) -> tuple[float, float] | None:
        """Return two times that enclose the first x = 0, or None if x does not vanish."""
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

    def _lowest(self, early: float, late: float, echo: "_EchoOfChain | None") -> float:
        """Return the time at which x is smallest, by bisection."""
        for _ in range(40):
            middle = 0.5 * (early + late)
            if self._motion(middle, echo)[1] < 0.0:
                early = middle
            else:
                late = middle
        return late

    def _motion(self, flown: float, echo: "_EchoOfChain | None") -> tuple[float, float]:
        """Return x and its rate at a time after the last contact."""
        turned = self._state * np.exp(_RATES * flown)
        place = self.surplus - self._pushed(flown) + float(turned.sum().real)
        speed = self._decline * flown - self.push + float((_RATES * turned).sum().real)
        if echo is not None:
            back, rate = echo.of(self.times[-1] + flown, self.times, self.momenta)
            place, speed = place + back, speed + rate
        return place, speed

    def _root(self, early: float, late: float, echo: "_EchoOfChain | None") -> float:
        """Return the time at which x falls through zero, by Newton's method between two bounds."""
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


class _EchoOfChain:
    """Echo E_n and its rate, from Chebyshev panels of length 1 around 2n."""

    def __init__(self, particles: int) -> None:
        from scipy.special import jv

        width = (particles / 4.0) ** (1.0 / 3.0)
        self.start = math.floor(max(2.0 * particles - _BEFORE * width, 1.0))
        self.end = math.ceil(2.0 * particles + _BEHIND * width + 20.0)
        nodes = np.polynomial.chebyshev.chebpts1(_PANEL_NODES)
        times = np.arange(self.start, self.end + 2)[:, None] + 0.5 * (nodes + 1.0)
        order = 4 * particles
        rates = sum((order + k) * jv(order + k, 2.0 * times) for k in (-1, 1)) / times
        to_coefficients = np.linalg.inv(np.polynomial.chebyshev.chebvander(nodes, _PANEL_NODES - 1))
        self._rates = to_coefficients @ rates.T
        self._places = np.polynomial.chebyshev.chebint(self._rates, lbnd=-1, scl=0.5)
        grown = np.polynomial.chebyshev.chebval(1.0, self._places)
        self._places[0] += np.concatenate(([0.0], np.cumsum(grown)[:-1]))

    def of(self, time: float, times: list[float], momenta: list[float]) -> tuple[float, float]:
        """Return the sum of the echoes of all contacts, and its rate."""
        # More than a unit of time passes between two contacts.
        early = np.array(times[: int(self.end - self.start)])
        ways = time - self.start - early
        ways = ways[ways >= 0.0]
        panel = ways.astype(int)
        inside = 2.0 * (ways - panel) - 1.0
        weights = np.array(momenta[: len(ways)])
        chebval = np.polynomial.chebyshev.chebval
        place = chebval(inside, self._places[:, panel], tensor=False)
        rate = chebval(inside, self._rates[:, panel], tensor=False)
        return float(weights @ place), float(weights @ rate)


def collide_long_chains(lengths: Iterable[int]) -> Iterator[HarmonicCollision]:
    """
    Compute the collisions of long harmonic chains.

    One half-infinite chain gives the early contacts for all lengths. The cost of a contact
    therefore does not depend on the length. The second echo, which returns at 4n, is neglected,
    because the chain has already left the wall.

    Parameters
    ----------
    lengths : iterable of int
        Number of particles of each chain, 20 or more.

    Yields
    ------
    HarmonicCollision
        Collisions in the order of their ends: the shortest chain first.

    Raises
    ------
    ValueError
        If a chain has fewer than 20 particles, because its echoes overlap.
    """
    pressed = PressedEnd()
    for particles in sorted(lengths):
        if particles < 20:
            raise ValueError(f"{particles} particles given. Give 20 or more")
        echo = _EchoOfChain(particles)
        # The shared chain stops before any echo. Longer chains can then continue from its state.
        while pressed.times[-1] < echo.start - 10.0 and pressed.next_contact(until=echo.start):
            pass
        own = deepcopy(pressed)
        while own.next_contact(echo, echo.end):
            pass
        rebound = math.fsum(own.momenta) / particles - 1.0
        error = _ERROR_PER_PARTICLE * particles
        yield HarmonicCollision(particles, rebound**2, error, len(own.times), own.times[-1])


def front_lead(contacts: int = 2000) -> float:
    r"""
    Return the lead of the front of a harmonic chain at a wall, in bond lengths.

    The first contact gives the momentum 2 v0 at once; a constant force would have given none by
    then. Averaged over steady contacts, the momentum from the wall is :math:`v_0 (t + \beta)` with
    :math:`\beta = 0.9945645`.

    Parameters
    ----------
    contacts : int
        Number of contacts. The second half of them is averaged.

    Returns
    -------
    float
        beta.
    """
    end = PressedEnd()
    surpluses = [end.surplus]
    while len(end.times) <= contacts:
        end.next_contact()
        surpluses.append(end.surplus)
    half = contacts // 2
    intervals: Array = np.diff(end.times[half:])
    # Between contacts the surplus decreases at unit rate.
    middle = np.array(surpluses[half:-1]) - 0.5 * intervals
    return float(np.average(middle, weights=intervals))
