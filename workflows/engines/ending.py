r"""
The end of a collision: why no further contact can come, or how likely one is.

The restitution is that of long times: a contact that comes late counts like any other. At a look,
the chain is cut into pieces that stay apart (see ``pieces``), and the first piece is judged. For
particle 1 to be at the wall, its bonds must stretch as far as the mean of the piece has gone, and
to hit the wall it must move against that mean:

.. math:: U_\text{least}(D) + \tfrac12 V^2 \frac{m}{m - 1} \le I,

where D is the mean displacement of the m particles, V their mean velocity and I the internal
energy. An end is

*proved* where V > 0, that inequality fails, and every cut is proved. A cut only pulls the piece
away from the wall, so D and V never fall, and I is taken with all that the pull can add.

*argued* where the energy would suffice for a return, but nearly all of it would have to gather in
one vibration, which is very unlikely (``piece_bounds.escape_risk``), and where this has been so,
without a contact, for longer than sound needs to cross the chain and come back; or where the first
piece recedes after the longest time that is followed, without a contact in all of it, and this does
not hinge on errors.

*open* where the first piece still approaches the wall then, or where motions that hardly differ
disagree on a late contact, or on the state of a piece that has the energy for one. The momentum
that contacts could bring is told, and belongs into the error bar.
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

# Sound in stretched bonds is slower than at natural length; the quiet time allows for a tenth.
QUIET_ROUND_TRIPS = 1.1

# The next three are choices, not measurements: how often bars fail with them is counted by
# `benchmarks.judge.plain`.
# An end is argued where a return is less likely than this.
RISK_ALLOWED = 1e-3
# Where motions come to different ends, a return less likely than this, which none of them had, is
# not reckoned with.
RISK_AT_STAKE = 0.02
# What a part is thrown out with is reckoned to exceed its bound so often.
UNLIKELY = 0.01

EndingKind = Literal["proved", "argued", "open"]


@dataclass(frozen=True)
class Ending:
    """How a collision ended."""

    kind: EndingKind  #: ``proved``, ``argued`` or ``open``.
    #: Largest momentum that contacts after an open end could give the chain; 0 for the others.
    missed_momentum: float = 0.0
    #: The same of an argued end, were the motion another: 0 where no motion brings a contact but by
    #: a rare gathering of energy.
    momentum_at_stake: float = 0.0

    def doubted(self, momentum: float) -> "Ending":
        """
        Return the end as it is known when late contacts of some momentum, 0 for none, are in doubt.

        Hardly different motions have these contacts or have not: it is open where they could give
        more than is known of already.
        """
        return Ending("open", momentum) if momentum > self.missed_momentum else self


def sound_round_trip(particles: int, stiffness: float) -> float:
    """
    Return how long an argument must hold: until sound has crossed the chain and come back.

    `stiffness` is U''(1) over the mean mass.
    """
    return QUIET_ROUND_TRIPS * 2.0 * particles / stiffness**0.5


def return_risk(pieces: Fragments, bond: Potential) -> float:
    """
    Estimate how likely particle 1 is to hit the wall again.

    0 where it is proved that it does not; 1 while the first piece, or the chain, approaches.
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
        return 1.0  # not yet far enough: no bond need break
    alone = escape_risk(bond, energy, lever, speed, VIBRATIONS * float(pieces.sizes.sum()))
    return min(1.0, pieces.return_risk + alone)


def approach(*bodies: Fragments) -> float:
    r"""
    Return the largest momentum that a first piece which approaches the wall can be given there.

    It turns round with all its energy at most: :math:`m |V| + \sqrt{2 m (I + m V^2/2)}`. Of two
    bodies, the chain and a free target, m is the reduced mass of the first pieces, V their relative
    velocity and I the sum.
    """
    masses = [float(pieces.weights[0]) for pieces in bodies]
    mass = masses[0] if len(masses) == 1 else 1.0 / sum(1.0 / each for each in masses)
    speed = sum(float(pieces.speeds[0]) for pieces in bodies)
    internal = sum(float(pieces.energies[0]) for pieces in bodies if pieces.sizes[0] > 1)
    return mass * abs(speed) + math.sqrt(2.0 * mass * internal + (mass * speed) ** 2)


def evaporation(pieces: Fragments, bond: Potential) -> float:
    r"""
    Return the largest momentum that a part thrown out by a piece would be given at the wall.

    Of the mass m a part :math:`m'` moves at :math:`w` relative to the others, with the energy
    :math:`\tfrac12 \mu w^2`, :math:`\mu = m'(m - m')/m`, and hit the wall at :math:`w (m - m')/m -
    V`, or pieces before them, which hand that on. Of the energy that breaking leaves, :math:`I -
    E`, which is shared freely, one motion of n particles gets more than :math:`(I - E)(1 -
    q^{1/(n-2)})` with the probability q. 0 where no part can come back.
    """
    breaking = breaking_energy(bond)
    paid = breaking if math.isfinite(breaking) else 0.0
    # The others matter where they may disturb the first.
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
    Return by what no further contact can come, ``proved`` or ``argued``, from one state alone.

    None where one may. The state is that of a :class:`pieces.Body`.
    """
    if float(np.sum(velocities)) <= 0.0:
        return None
    risk = return_risk(Body(first_displacement, strains, velocities).pieces(bond), bond)
    if risk == 0.0:
        return "proved"
    silent = since_contact > sound_round_trip(len(velocities), bond.stiffness)
    return "argued" if silent and risk <= RISK_ALLOWED else None
