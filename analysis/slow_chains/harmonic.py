r"""
Long harmonic chains against a wall, by what comes back from their free end.

Particle 1 of a half-infinite chain is followed as ``pressed_end`` says. In a chain
of n, mirrored at both of its ends, what comes back of it is

.. math:: E_n(t) = \int_0^t \left[J_{4n-2} + 2 J_{4n} + J_{4n+2}\right](2\tau)\, d\tau,

which is nothing before 2n. So all chains share their contacts up to about t = 2n, a contact costs
the same at any length, and the end of a collision needs the echo of the first contacts only.
Units: mass, stiffness and impact speed 1.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from chaincor.analysis.slow_chains.pressed_end import PressedEnd
from chaincor.lammps_inputs.arrays import Array

# Airy's function is 1e-13 at 9 widths before the front. Wall and chain part at 0.4 behind it, where
# F = 1/2, and the gap grows as long as F is more: it never falls below 0.8 again.
_BEFORE, _BEHIND = 10.0, 4.0
_PANEL_NODES = 16
# Of 76 lengths from 100 to 10000 the largest difference from the modal engine is a third of this.
_ERROR_PER_PARTICLE = 5e-12


@dataclass(frozen=True)
class HarmonicCollision:
    """The collision of a long harmonic chain."""

    particles: int  #: Number of particles n.
    restitution: float  #: eta, the ratio of energies.
    restitution_error: float  #: A bound on its error.
    contacts: int  #: How often particle 1 hit the wall.
    last_contact_time: float  #: From the first contact.


class _EchoOfChain:
    """E_n and its rate, from Chebyshev panels of length 1 around 2n."""

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
        """Return what has come back of all contacts, and its rate."""
        # Contacts are more than a time unit apart.
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
    Carry harmonic chains of many particles through their collisions.

    One half-infinite chain serves all; a contact takes about 0.1 ms at any length. The echo of
    the wall's first echo, which comes at 4n, is left out: the chain has left by then.

    Parameters
    ----------
    lengths : iterable of int
        Particles of each chain, 20 or more.

    Yields
    ------
    HarmonicCollision
        As they end: by length, the shortest first.

    Raises
    ------
    ValueError
        If a chain is shorter than 20 particles, where echoes overlap.
    """
    pressed = PressedEnd()
    for particles in sorted(lengths):
        if particles < 20:
            raise ValueError(f"{particles} particles given; expected 20 or more")
        echo = _EchoOfChain(particles)
        # It stays before any echo, so that longer chains go on from there.
        while pressed.times[-1] < echo.start - 10.0 and pressed.next_contact(until=echo.start):
            pass
        own = pressed.branch()
        while own.next_contact(echo, echo.end):
            pass
        rebound = math.fsum(own.momenta) / particles - 1.0
        error = _ERROR_PER_PARTICLE * particles
        yield HarmonicCollision(particles, rebound**2, error, len(own.times), own.times[-1])


def front_lead(contacts: int = 2000) -> float:
    r"""
    Return by how much the front of a pressed harmonic chain is ahead, in bond lengths.

    The first contact gives 2 v0 at once, where a steady force would have given nothing: the wall's
    momentum is :math:`v_0 (t + \beta)` on average over steady contacts, :math:`\beta = 0.9945645`.

    Parameters
    ----------
    contacts : int
        How many are followed; the mean is over the second half.

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
    # Between contacts the surplus falls by the time.
    middle = np.array(surpluses[half:-1]) - 0.5 * intervals
    return float(np.average(middle, weights=intervals))
