r"""
Pieces of a broken chain, and what keeps them apart.

A stretched bond only ever pulls its ends towards each other. A piece in front of a stretched bond
is therefore pulled away from the wall, never towards it, and what the rest of the chain can do to
it is bounded as long as that bond stays stretched. Cuts are stretched bonds beyond their
inflection, where the pull falls with the length. If the gap at a cut never gets shorter than
:math:`g + w t`, the pull across it gives each side the momentum

.. math:: J \le \int_0^\infty U'(g + w t)\,dt = \frac{U(\infty) - U(g)}{w}

at most, and since no particle moves faster in the frame of its piece than
:math:`\sqrt{2 I}`, where I is the internal energy, :math:`\sqrt{2 I}` grows by J at most. Where the
gaps so worsened still grow as was assumed, they do so for ever: a proof.

Inside a piece, the end particle is displaced from where the mean has it by
:math:`D = \sum_i w_i s_i` with weights :math:`w_i = i/m`. With :math:`\kappa` the smallest
:math:`2 U/s^2` that bonds of energy I or less can have, Cauchy and Schwarz give
:math:`D^2 \le 2 I \sum_i w_i^2/\kappa`, and where U is convex, Jensen
:math:`U(D/W) \le I w_{m-1}/W` with :math:`W = \sum_i w_i`. A piece whose energy suffices to break
a bond is bounded otherwise: what lies farther out than the displacement that costs 0.9 of a broken
bond has only the rest of the energy to move with.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential, bond_strains

Array = NDArray[np.float64]

# Energy of a broken bond that is taken as paid once an end particle is far out.
PAID = 0.9
# Vibrations a particle with which risks are reckoned.
VIBRATIONS = 100.0
# Of an escape for which there is energy.
_LEAST_RISK = 1e-300
# Bounds are worked out for energies on a ladder of this ratio, and kept.
_LADDER = math.log(1.03)
# Part of the present speed of separation that must be left when all pulls are counted.
_LEFT = 0.5
# The pull is reckoned with gaps that the pull itself makes smaller.
_RESERVE = 1.5
# Verlet steps that look ahead keep energies to some parts in a thousand.
ENERGY_MARGIN = 1.01


@dataclass(frozen=True)
class Pieces:
    """
    A chain cut at stretched bonds.

    Attributes
    ----------
    sizes : ndarray of shape (pieces,)
        Particles in each.
    speeds : ndarray of shape (pieces,)
        Centre-of-mass velocities, positive away from the wall.
    energies : ndarray of shape (pieces,)
        Internal energies, with what pulls across the cuts can ever add.
    displacements : ndarray of shape (pieces,)
        Mean of x_i - (i - 1).
    return_risk : float
        How likely the others are to disturb the first piece so that it meets the wall again: 0
        where that is ruled out.
    """

    sizes: NDArray[np.int64]
    speeds: Array
    energies: Array
    displacements: Array
    return_risk: float


def breaking_energy(bond: Potential) -> float:
    """
    Return the energy that a bond cannot hold.

    Parameters
    ----------
    bond : Potential
        The bond.

    Returns
    -------
    float
        That of dissociation, or of the barrier beyond which the bond runs away; inf for others.
    """
    return min(bond.dissociation, bond.barrier)


def reach(bond: Potential, energy: float, particles: int) -> float:
    """
    Return how far an end particle can get from where the mean of its piece has it.

    Parameters
    ----------
    bond : Potential
        The bonds' potential.
    energy : float
        All energy that the bonds can have.
    particles : int
        Particles of the piece.

    Returns
    -------
    float
        inf where the energy suffices to break a bond.
    """
    if particles == 1 or energy <= 0.0:
        return 0.0
    if energy >= breaking_energy(bond):
        return math.inf
    longest, softest = _extent(bond, _on_ladder(bond, energy))
    squares = (particles - 1) * (2 * particles - 1) / (6.0 * particles)
    total = 0.5 * (particles - 1)
    far = total * longest
    if softest > 0.0:
        far = min(far, math.sqrt(2.0 * energy * squares / softest))
    if longest <= bond.convex_strain:
        mean = energy * (particles - 1) / (particles * total)
        far = min(far, total * _extent(bond, _on_ladder(bond, mean))[0])
    return far


def _on_ladder(bond: Potential, energy: float) -> float:
    """Return an energy that is a little higher, one of few; never one that breaks the bond."""
    rung = math.ceil(math.log(energy / bond.stiffness) / _LADDER)
    higher = bond.stiffness * math.exp(rung * _LADDER)
    return higher if higher < breaking_energy(bond) else energy


@lru_cache(maxsize=8192)
def _extent(bond: Potential, energy: float) -> tuple[float, float]:
    """Return the longest strain of bonds that hold an energy at most, and the least 2 U/s^2."""
    lowest, longest = bond_strains(bond, energy)
    strains = np.linspace(lowest, longest, 66)
    strains = strains[strains != 0.0]
    with np.errstate(divide="ignore"):  # a bond compressed to nothing
        softest = 2.0 * float(np.min(bond.energy(strains) / strains**2))
    return longest, min(bond.stiffness, softest)


def escape_risk(
    bond: Potential, energy: float, particles: int, speed: float, patience: float
) -> float:
    r"""
    Estimate how likely a piece is to throw its end particle out with a speed.

    The energy that takes is :math:`E^* = U(\infty) + \frac12 u^2 \frac{m}{m-1}`. Less than that is
    a proof. More is judged as unimolecular decay is: of m - 1 vibrations that share the energy I
    freely, one has E* or more with the probability :math:`(1 - E^*/I)^{m-2}`, at each vibration;
    and a piece that decays at all does so with that much in
    :math:`((I - E^*)/(I - U(\infty)))^{m-2}` of the cases, and cools. Over a barrier, beyond which
    a bond gains energy without bound, :math:`E^*` is the barrier alone, whatever the speed. Where
    nothing binds, nothing needs to gather: particles hand their velocities on.

    Parameters
    ----------
    bond : Potential
        The bonds' potential.
    energy : float
        Internal energy.
    particles : int
        Particles of the piece.
    speed : float
        Relative to the mean of the piece; no escape is possible with less than none.
    patience : float
        Number of vibrations to be reckoned with.

    Returns
    -------
    float
        Between 0 and 1.
    """
    if particles == 1:
        return 0.0
    if speed <= 0.0:
        return 1.0
    breaking = breaking_energy(bond)
    needed = breaking
    if math.isinf(bond.barrier):
        needed += 0.5 * speed * speed * particles / (particles - 1)
    if energy < needed:
        return 0.0
    if breaking == 0.0:
        return 1.0
    freedoms = particles - 2
    decays = math.exp(freedoms * math.log1p(-needed / energy)) if energy > needed else 0.0
    part = (energy - needed) / (energy - breaking)
    times = energy / breaking
    # What is only unlikely is never taken for impossible, however long the piece.
    return min(1.0, max(_LEAST_RISK, min(patience * decays, times * part**freedoms)))


def find_pieces(
    first_displacement: float,
    strains: Array,
    velocities: Array,
    bond: Potential,
) -> Pieces:
    """
    Cut a chain into as many pieces as move apart.

    Parameters
    ----------
    first_displacement : float
        Distance of particle 1 from the wall.
    strains : ndarray of shape (n - 1,)
        Bond lengths less one.
    velocities : ndarray of shape (n,)
        Particle velocities, positive away from the wall.
    bond : Potential
        The bonds' potential.

    Returns
    -------
    Pieces
        One at least. Pieces that approach, or whose motion does not break the bond between them,
        are taken as one.
    """
    chain = _Chain(first_displacement, strains, velocities, bond)
    cuts = np.empty(0, dtype=np.int64)
    if math.isfinite(bond.dissociation):
        cuts = np.flatnonzero(strains > bond.convex_strain)
    while True:
        cutting = chain.cut_at(cuts)
        failing = np.flatnonzero(~cutting.apart & (cutting.binding <= 0.0))
        if len(failing) == 0:
            return chain.judge(cutting)
        # Those most firmly bound first: with them taken as one, the others may move apart.
        bound = failing[np.argsort(cutting.binding[failing])]
        cuts = np.delete(cuts, bound[: max(1, len(failing) // 3)])


@dataclass(frozen=True)
class _Cutting:
    """
    A partition: its cuts, and what is known of its pieces and of each cut.

    `apart` tells for which cuts it is proved that the pieces stay apart; `binding` is the energy
    of relative motion across a cut less what breaks the bond, negative where pieces approach.
    """

    cuts: NDArray[np.int64]
    sizes: NDArray[np.int64]
    speeds: Array
    means: Array
    energies: Array
    apart: NDArray[np.bool_]
    binding: Array


class _Chain:
    """A state, with what all its partitions need."""

    def __init__(self, first: float, strains: Array, velocities: Array, bond: Potential) -> None:
        self.displacements = np.cumsum(np.concatenate(([first], strains)))
        self.strains, self.velocities, self.bond = strains, velocities, bond
        self.patience = VIBRATIONS * len(velocities)
        with np.errstate(over="ignore"):  # an exploded motion, which its energy gives away
            self.bond_energies = np.append(bond.energy(strains), 0.0)

    def cut_at(self, cuts: NDArray[np.int64]) -> _Cutting:
        """Take the chain as cut there."""
        bond = self.bond
        starts = np.concatenate(([0], cuts + 1))
        sizes = np.diff(np.append(starts, len(self.velocities)))
        speeds = np.add.reduceat(self.velocities, starts) / sizes
        means = np.add.reduceat(self.displacements, starts) / sizes
        inner = self.bond_energies.copy()
        inner[cuts] = 0.0
        with np.errstate(over="ignore"):
            motion = 0.5 * (self.velocities - np.repeat(speeds, sizes)) ** 2
            energies = ENERGY_MARGIN * np.add.reduceat(motion + inner, starts)
        if len(cuts) == 0:
            none = np.empty(0)
            return _Cutting(cuts, sizes, speeds, means, energies, none.astype(bool), none)
        opening = np.diff(speeds)
        reduced = 1.0 / (1.0 / sizes[:-1] + 1.0 / sizes[1:])
        binding = 0.5 * reduced * opening * np.abs(opening)
        binding += self.bond_energies[cuts] - bond.dissociation
        binding = np.where(opening > 0.0, binding, np.minimum(binding, -np.abs(opening)))
        gaps, growths = self._gaps(cuts, sizes, means, speeds[:-1], speeds[1:], energies)
        kept = _LEFT * growths
        apart = (gaps >= bond.convex_strain) & (kept > 0.0)
        pulls = _RESERVE * self._pull(gaps, kept, apart)
        worse = self._worsened(energies, pulls)
        later, slower = self._gaps(
            cuts,
            sizes,
            means,
            speeds[:-1] + pulls / sizes[:-1],
            speeds[1:] - pulls / sizes[1:],
            worse,
        )
        apart &= (later >= bond.convex_strain) & (slower >= kept)
        apart &= self._pull(later, kept, apart) <= pulls
        # Where nothing is proved, the pull is that of the present motion.
        present = self._pull(self.strains[cuts], _LEFT * opening, opening > 0.0)
        worse = self._worsened(energies, np.where(apart, pulls, present))
        return _Cutting(cuts, sizes, speeds, means, worse, apart, binding)

    def judge(self, cutting: _Cutting) -> Pieces:
        """Work out how likely what happens at any cut is to reach the wall."""
        speeds, energies = cutting.speeds, cutting.energies
        disturbed = 0.0
        for k in range(len(cutting.cuts) - 1, -1, -1):
            risk = 0.0
            if not cutting.apart[k]:
                opening = float(speeds[k + 1] - speeds[k])
                risk = max(
                    self._escape(float(energies[j]), int(cutting.sizes[j]), opening)
                    for j in (k, k + 1)
                )
            if disturbed > 0.0:
                risk += disturbed * self._group_escape(cutting.cuts[k] + 1, float(speeds[k]))
            disturbed = min(risk, 1.0)
        if disturbed > 0.0:
            disturbed *= self._group_escape(0, 0.0)
        return Pieces(cutting.sizes, speeds, energies, cutting.means, disturbed)

    def _escape(self, energy: float, particles: int, speed: float) -> float:
        return escape_risk(self.bond, energy, particles, speed, self.patience)

    def _group_escape(self, start: int, speed: float) -> float:
        """Return the risk that all from a particle on, taken as one, throw one back to a speed."""
        velocities = self.velocities[start:]
        mean = float(np.mean(velocities))
        energy = 0.5 * float(np.sum((velocities - mean) ** 2))
        energy += float(np.sum(self.bond_energies[start:]))
        return self._escape(ENERGY_MARGIN * energy, len(velocities), mean - speed)

    def _gaps(self, cuts, sizes, means, behind, ahead, energies) -> tuple[Array, Array]:
        """Return strains of the cut bonds, and their growth, that no motion can fall below."""
        ends = np.array([self._end(*each) for each in zip(energies, sizes, strict=True)])
        fixed, escape = ends[:, 0], ends[:, 1]
        # Displacements now, where they are beyond what is reckoned with.
        back = np.maximum(fixed[:-1], self.displacements[cuts] - means[:-1])
        front = np.maximum(fixed[1:], means[1:] - self.displacements[cuts + 1])
        gaps = (means[1:] - front) - (means[:-1] + back)
        return gaps, ahead - behind - escape[1:] - escape[:-1]

    def _end(self, energy: float, particles: int) -> tuple[float, float]:
        """Return how far an end particle gets, and how fast it leaves beyond that."""
        bond = self.bond
        if energy < PAID * bond.dissociation or particles == 1:
            return reach(bond, energy, int(particles)), 0.0
        paid = PAID * bond.dissociation
        rest = 2.0 * (energy - paid) * (particles - 1) / particles
        return reach(bond, paid, int(particles)), math.sqrt(rest)

    def _pull(self, gaps: Array, growths: Array, where: NDArray[np.bool_]) -> Array:
        """Return the momentum that the pull across gaps gives in all the future."""
        bond = self.bond
        gaps, growths = np.where(where, gaps, 1.0), np.where(where, growths, 1.0)
        return np.where(where, (bond.dissociation - bond.energy(gaps)) / growths, 0.0)

    @staticmethod
    def _worsened(energies: Array, pulls: Array) -> Array:
        """Return internal energies with what pulls from both sides add."""
        sides = np.append(0.0, pulls) + np.append(pulls, 0.0)
        return 0.5 * (np.sqrt(2.0 * energies) + sides) ** 2


def count_fragments(strains: Array, velocities: Array, bond: Potential) -> int:
    """
    Return how many connected pieces a chain has at a moment.

    A bond counts as broken while it stretches and the energy of the relative motion of its ends
    (reduced mass 1/2) plus U exceeds dissociation.

    Parameters
    ----------
    strains : ndarray of shape (n - 1,)
        Bond lengths less one.
    velocities : ndarray of shape (n,)
        Particle velocities.
    bond : Potential
        The bonds' potential.

    Returns
    -------
    int
        One at least.
    """
    if math.isinf(bond.dissociation):
        return 1
    opening = np.diff(velocities)
    relative = 0.25 * opening**2 + bond.energy(strains)
    broken = (strains > 0.0) & (opening > 0.0) & (relative > bond.dissociation)
    return 1 + int(np.count_nonzero(broken))
