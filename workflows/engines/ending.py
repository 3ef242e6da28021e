r"""
Decide whether a collision is over, from the evidence that no further contact comes.

The restitution is defined in the limit of long times; late contacts therefore count as well. To
judge a state, the chain is cut into fragments that stay apart (see ``fragments``), and the first
fragment is examined. Particle 1 can be at the wall only if the bonds of this fragment stretch as
far as the mean position of the fragment has moved. To hit the wall, the particle must move against
the mean velocity:

.. math:: U_\text{least}(D) + \tfrac12 V^2 \frac{m}{m - 1} \le I,

Here :math:`U_\text{least}(D)` is the least bond energy with which particle 1 can be at the wall.
The fragment has m particles, D is their mean displacement, V their mean velocity and I their
internal energy. An end is

*proved* if V > 0, the inequality fails and the fragments at every cut provably stay apart. The bond
at a cut only pulls the fragment away from the wall; D and V therefore never fall. The energy I
includes all energy that this pull can add.

*argued* in two cases. In the first case, the energy would suffice for a return, but nearly all
energy would have to gather in one vibration, which is very unlikely
(``fragment_bounds.escape_risk``). This risk must have stayed low for longer than a sound round trip
without a contact. In the second case, the first fragment still recedes when the time limit of the
search is reached, and errors of the motion do not change this result.

*open* if the first fragment still approaches the wall at the time limit. An end is also open if
nearly equal motions disagree about a late contact, or about the state of a fragment with enough
energy for a late contact. An open end reports the momentum that contacts could give; the error bar
includes this momentum.
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

# An end is argued only after this number of sound round trips without a contact. The number exceeds
# 1 because sound in stretched bonds is up to a tenth slower than in bonds of natural length.
QUIET_ROUND_TRIPS = 1.1

# The next three constants are choices, not measurements; `tests.judge.plain` counts how often error
# bars fail with these values. An end is argued if the probability of a return is below
# RISK_ALLOWED.
RISK_ALLOWED = 1e-3
# If nearly equal motions end differently, a return to the wall is neglected if it occurs in none of
# these motions and its probability is below this limit.
RISK_AT_STAKE = 0.02
# `evaporation` uses a bound on the energy of an ejected part. The true energy exceeds this bound
# with this probability.
UNLIKELY = 0.01

EndingKind = Literal["proved", "argued", "open"]


@dataclass(frozen=True)
class Ending:
    """End of a collision."""

    kind: EndingKind  #: ``proved``, ``argued`` or ``open``.
    #: Largest momentum that contacts could give the chain after an open end; 0 for other ends.
    missed_momentum: float = 0.0
    #: For an argued end, the largest momentum that late contacts could give the chain in a nearly
    #: equal motion; 0 if only a rare concentration of energy could cause a contact.
    momentum_at_stake: float = 0.0

    def doubted(self, momentum: float) -> "Ending":
        """
        Return the end if nearly equal motions disagree about late contacts.

        `momentum` is the largest momentum that late contacts could give the chain; 0 if there are
        none. The end is open if this momentum exceeds the momentum that the end already reports.
        """
        return Ending("open", momentum) if momentum > self.missed_momentum else self


def sound_round_trip(particles: int, stiffness: float) -> float:
    """Return the waiting time before an end is argued: a sound round trip through the chain."""
    return QUIET_ROUND_TRIPS * 2.0 * particles / stiffness**0.5


def return_risk(pieces: Fragments, bond: Potential) -> float:
    """
    Return the estimated probability that particle 1 hits the wall again.

    The probability is 0 if a return is provably excluded. It is 1 while the first fragment, or the
    centre of mass of the chain, approaches the wall.
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
        return 1.0  # particle 1 can still reach the wall without breaking a bond
    alone = escape_risk(bond, energy, lever, speed, VIBRATIONS * float(pieces.sizes.sum()))
    return min(1.0, pieces.return_risk + alone)


def approach(*bodies: Fragments) -> float:
    r"""
    Return the largest impulse that a wall can give a first fragment that approaches the wall.

    The impulse :math:`m |V| + \sqrt{2 m (I + m V^2/2)}` is reached if all energy of the fragment
    becomes translation. For a chain and a free target, m is the reduced mass of the two first
    fragments, V their relative velocity and I the sum of their internal energies.
    """
    masses = [float(pieces.weights[0]) for pieces in bodies]
    mass = masses[0] if len(masses) == 1 else 1.0 / sum(1.0 / each for each in masses)
    speed = sum(float(pieces.speeds[0]) for pieces in bodies)
    internal = sum(float(pieces.energies[0]) for pieces in bodies if pieces.sizes[0] > 1)
    return mass * abs(speed) + math.sqrt(2.0 * mass * internal + (mass * speed) ** 2)


def evaporation(pieces: Fragments, bond: Potential) -> float:
    r"""
    Return the largest impulse that a wall can give a part that a fragment ejects.

    The fragment has the mass m. A part of it, with the mass :math:`m'`, moves at :math:`w` relative
    to the rest. The energy of this motion is :math:`\tfrac12 \mu w^2` with :math:`\mu = m'(m -
    m')/m`. The part hits the wall at the speed :math:`w (m - m')/m - V`, or it hits fragments in
    between, which pass the momentum on. A bond breaks with the energy E; the rest of the internal
    energy, :math:`I - E`, is shared freely among n particles. The energy of one motion exceeds
    :math:`(I - E)(1 - q^{1/(n-2)})` with the probability q. Return 0 if no part can come back.
    """
    breaking = breaking_energy(bond)
    paid = breaking if math.isfinite(breaking) else 0.0
    # Other fragments matter only if the risk that they disturb the first fragment is not
    # negligible.
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
    Return ``proved`` or ``argued`` for an end judged from one state, None if a contact may come.

    The first displacement, the strains and the velocities are defined in :class:`fragments.Body`.
    """
    if float(np.sum(velocities)) <= 0.0:
        return None
    risk = return_risk(Body(first_displacement, strains, velocities).pieces(bond), bond)
    if risk == 0.0:
        return "proved"
    silent = since_contact > sound_round_trip(len(velocities), bond.stiffness)
    return "argued" if silent and risk <= RISK_ALLOWED else None
