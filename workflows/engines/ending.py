r"""
Decide whether a collision is over, from the evidence that no further contact comes.

The restitution is defined in the limit of long times, so late contacts count as well. To
judge a state, the chain is cut into fragments that stay apart (see ``fragments``), and the first
fragment is examined. Particle 1 can be at the wall only if the bonds of this fragment stretch as
far as its mean has moved. To hit the wall, the particle must move against the mean:

.. math:: U_\text{least}(D) + \tfrac12 V^2 \frac{m}{m - 1} \le I,

Here D is the mean displacement of the m particles, V their mean velocity and I the internal energy.
An end is

*proved* if V > 0, the inequality fails and a proof shows that the fragments at every cut stay
apart. A cut only pulls the fragment away from the wall, so D and V never fall, and I includes all
energy that the pull can add.

*argued* in two cases. First, the energy would suffice for a return, but nearly all of it would have
to gather in one vibration, which is very unlikely (``fragment_bounds.escape_risk``), and this has
held without a contact for longer than a sound round trip. Second, the first fragment recedes after
the longest time that is followed without a contact, and this does not depend on errors of the
motion.

*open* if the first fragment still approaches the wall at that time, or if nearly equal motions
disagree on a late contact or on the state of a fragment that has the energy for one. An open end
reports the momentum that contacts could give, which belongs to the error bar.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.fragment_bounds import (
    PAID,
    VIBRATIONS,
    breaking_energy,
    escape_risk,
    reach,
)
from chaincor.workflows.engines.fragments import Body, Fragments

# Sound in stretched bonds is slower than at natural length, by up to a tenth here.
QUIET_ROUND_TRIPS = 1.1

# The next three constants are choices, not measurements; `tests.judge.plain` counts how often
# error bars fail with them. An end is argued if a return is less likely than this.
RISK_ALLOWED = 1e-3
# If motions come to different ends, a return that none of them had and that is less likely than
# this is neglected.
RISK_AT_STAKE = 0.02
# The energy of an ejected part exceeds its bound with this probability.
UNLIKELY = 0.01

EndingKind = Literal["proved", "argued", "open"]


@dataclass(frozen=True)
class Ending:
    """End of a collision."""

    kind: EndingKind  #: ``proved``, ``argued`` or ``open``.
    #: Largest momentum that the chain could get from contacts after an open end; 0 for other ends.
    missed_momentum: float = 0.0
    #: Largest momentum of contacts after an argued end in a nearly equal motion; 0 if contacts are
    #: possible only by a rare concentration of energy.
    momentum_at_stake: float = 0.0

    def doubted(self, momentum: float) -> "Ending":
        """
        Return the end when nearly equal motions disagree on late contacts.

        The contacts have a given momentum, which is 0 for no contacts. The end is open if they
        could give more than the momentum that is already missing.
        """
        return Ending("open", momentum) if momentum > self.missed_momentum else self


def sound_round_trip(particles: int, stiffness: float) -> float:
    """Return the time for which an argument must hold, a sound round trip through the chain."""
    return QUIET_ROUND_TRIPS * 2.0 * particles / stiffness**0.5


def return_risk(pieces: Fragments, bond: Potential) -> float:
    """
    Return the estimated probability that particle 1 hits the wall again.

    It is 0 if a proof excludes this, and 1 while the first fragment, or the chain, approaches.
    """
    momentum = float(pieces.weights @ pieces.speeds)
    size, speed, lever = int(pieces.sizes[0]), float(pieces.speeds[0]), pieces.lever
    if momentum <= 0.0 or speed <= 0.0:
        return 1.0
    if size == 1:
        return pieces.return_risk
    energy, displacement = float(pieces.energies[0]), float(pieces.displacements[0])
    free = energy - 0.5 * speed * speed * lever.whole / lever.rest * lever.mass
    if displacement > 0.0 and reach(bond, free, lever) < displacement:
        return pieces.return_risk
    breaking = breaking_energy(bond)
    if free < breaking or displacement < reach(bond, PAID * breaking, lever):
        return 1.0  # particle 1 can still be at the wall without breaking a bond
    alone = escape_risk(bond, energy, lever, speed, VIBRATIONS * float(pieces.sizes.sum()))
    return min(1.0, pieces.return_risk + alone)


def approach(*bodies: Fragments) -> float:
    r"""
    Return the largest impulse at the wall on a first fragment that approaches it.

    The bound is reached if it leaves with all its energy: :math:`m |V| + \sqrt{2 m (I + m V^2/2)}`.
    For two bodies, the chain and a free target, m is the reduced mass of the first fragments, V
    their relative velocity and I the sum of their internal energies.
    """
    masses = [float(pieces.weights[0]) for pieces in bodies]
    mass = masses[0] if len(masses) == 1 else 1.0 / sum(1.0 / each for each in masses)
    speed = sum(float(pieces.speeds[0]) for pieces in bodies)
    internal = sum(float(pieces.energies[0]) for pieces in bodies if pieces.sizes[0] > 1)
    return mass * abs(speed) + math.sqrt(2.0 * mass * internal + (mass * speed) ** 2)


def evaporation(pieces: Fragments, bond: Potential) -> float:
    r"""
    Return the largest impulse at the wall on a part that a fragment ejects.

    A part :math:`m'` of the mass m moves at :math:`w` relative to the rest, with the energy
    :math:`\tfrac12 \mu w^2`, :math:`\mu = m'(m - m')/m`. It hits the wall at :math:`w (m - m')/m -
    V`, or hits fragments before it, which pass the momentum on. The energy left after breaking,
    :math:`I - E`, is shared freely among n particles; one motion gets more than :math:`(I - E)(1 -
    q^{1/(n-2)})` with the probability q. Return 0 if no part can come back.
    """
    breaking = breaking_energy(bond)
    paid = breaking if math.isfinite(breaking) else 0.0
    # The other fragments matter only if they may disturb the first one.
    count = 1 if pieces.return_risk <= RISK_ALLOWED else len(pieces.sizes)
    largest = 0.0
    begin = 0
    for j in range(count):
        size, mass = int(pieces.sizes[j]), float(pieces.weights[j])
        thrown = np.cumsum(pieces.masses[begin : begin + size])[:-1]
        begin += size
        part = 1.0 - UNLIKELY ** (1.0 / (size - 2)) if size > 2 else 1.0
        free = 2.0 * part * max(float(pieces.energies[j]) - paid, 0.0)
        hit = np.sqrt(free * (mass - thrown) / (thrown * mass)) - float(pieces.speeds[j])
        largest = max(largest, float(np.max(2.0 * thrown * hit, initial=0.0)))
    return largest


def argue_end(
    first_displacement: float,
    strains: NDArray[np.float64],
    velocities: NDArray[np.float64],
    since_contact: float,
    bond: Potential,
) -> str | None:
    """
    Return ``proved`` or ``argued`` for the end of one state alone, or None if a contact may come.

    The state is described as in :class:`fragments.Body`.
    """
    if float(np.sum(velocities)) <= 0.0:
        return None
    risk = return_risk(Body(first_displacement, strains, velocities).pieces(bond), bond)
    if risk == 0.0:
        return "proved"
    silent = since_contact > sound_round_trip(len(velocities), bond.stiffness)
    return "argued" if silent and risk <= RISK_ALLOWED else None
