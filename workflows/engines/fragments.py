r"""
Divide a broken chain into fragments, and prove that they stay apart.

A stretched bond pulls its two ends towards each other, and therefore pulls the fragment in front of
the bond away from the wall. While this bond stays stretched, the effect of the rest of the chain on
the fragment is bounded. The chain is cut at bonds that are stretched beyond their inflection; there
the pull decreases with the length. If the gap at a cut stays above :math:`g + w t` at the time t,
the pull across the cut gives each side at most the momentum

.. math:: J \le \int_0^\infty U'(g + w t)\,dt = \frac{U(\infty) - U(g)}{w}

In the frame of its fragment, no particle of mass m moves faster than :math:`\sqrt{2 I/m}`, where I
is the internal energy. Therefore :math:`\sqrt{2 I}` grows by at most :math:`J/\sqrt m`. If the gaps
grow as assumed even with these changes, they grow for ever, and the fragments provably stay apart.
"""

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import starmap
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.fragment_bounds import (
    PAID,
    VIBRATIONS,
    Lever,
    equal_lever,
    escape_risk,
    reach,
)

# The proof requires that all pulls together leave the fragments at least this fraction of their
# present speed of separation.
_LEFT = 0.5
# The bound on the pull includes this factor, because the pull itself makes the gaps smaller.
_RESERVE = 1.5
# Energies are multiplied by this factor, because the Verlet steps of look-ahead runs conserve
# energies only to a few parts in 1e3.
_ENERGY_RESERVE = 1.01


@dataclass(frozen=True)
class Fragments:
    """Chain cut at stretched bonds, with the properties of its fragments and cuts."""

    cuts: NDArray[np.int64]  #: Indices of the cut bonds; of shape (pieces - 1,).
    sizes: NDArray[np.int64]  #: Number of particles in each fragment; of shape (pieces,).
    masses: Array  #: Masses of all particles; of shape (n,).
    weights: Array  #: Masses of the fragments; of shape (pieces,).
    speeds: Array  #: Centre-of-mass velocities, positive away from the wall; of shape (pieces,).
    #: Internal energies, including all energy that pulls across the cuts can ever add; of shape
    #: (pieces,).
    energies: Array
    displacements: Array  #: Mean displacements x_i - (i - 1) of the fragments; of shape (pieces,).
    levers: list[tuple[Lever, Lever]]  #: Levers of both ends of each fragment.
    #: Whether the fragments on both sides of a cut provably stay apart; of shape (pieces - 1,).
    apart: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, bool))
    #: Probability that the other fragments send the first fragment back to the wall; 0 if a return
    #: is excluded.
    return_risk: float = 0.0

    @property
    def lever(self) -> Lever:
        """Weights with which bond strains of the first fragment displace particle 1."""
        return self.levers[0][0]


class Body(NamedTuple):
    """Body that moves away from another body: the chain, or a free target."""

    #: Distance from the wall, or from a plane between both bodies, to the particle at the contact.
    first_displacement: float
    strains: Array  #: Bond lengths less one, from the contact outward; of shape (n - 1,).
    velocities: Array  #: Velocities relative to this plane, positive away from it; of shape (n,).
    masses: Array | None = None  #: Masses; None if all are 1; of shape (n,).

    def has_finite_energy(self) -> bool:
        """Return whether the kinetic energy is finite; it overflows if a step is far too long."""
        with np.errstate(over="ignore", invalid="ignore"):
            squares = np.square(self.velocities)
            return math.isfinite(
                float(np.sum(squares if self.masses is None else self.masses * squares))
            )

    def pieces(self, bond: Potential) -> Fragments:
        """
        Return the fragments of the body that move apart; an unbroken body is one fragment.

        Two neighbouring fragments count as one fragment if they approach each other, or if their
        motion does not break the bond between them.
        """
        chain = _Chain(self, bond)
        cuts = np.empty(0, dtype=np.int64)
        if math.isfinite(bond.dissociation):
            (cuts,) = (self.strains > bond.convex_strain).nonzero()
        while len(cuts) and len(bound := chain.bound_cuts(cuts)):
            # Join the most firmly bound fragments first; the remaining fragments may then move
            # apart.
            apart = np.ones(len(cuts), bool)
            apart[bound[: max(1, len(bound) // 3)]] = False
            cuts = cuts[apart]
        pieces = chain.cut_at(cuts)
        risk = chain.return_risk(pieces)
        return replace(pieces, return_risk=risk) if risk > 0.0 else pieces


class _Chain:
    """
    State of a body, with the quantities needed for every way to cut it.

    For masses of 1, products with masses are left out; they would not change a digit. The search
    for the end of a short chain takes most of its time here.
    """

    def __init__(self, body: Body, bond: Potential) -> None:
        first, strains, velocities, masses = body
        self.unit = masses is None
        self.masses = np.ones(len(velocities)) if masses is None else masses
        places, energies = np.empty((2, len(velocities)))
        places[0], places[1:], energies[-1] = first, strains, 0.0
        self.displacements = places.cumsum()
        self.strains, self.velocities, self.bond = strains, velocities, bond
        self.momenta = velocities if self.unit else self.masses * velocities
        self.patience = VIBRATIONS * len(velocities)
        with np.errstate(over="ignore"):  # an exploded motion is detected by its energy
            energies[:-1] = bond.energy(strains)
        self.bond_energies = energies

    def bound_cuts(self, cuts: NDArray[np.int64]) -> NDArray[np.int64]:
        """
        Return the indices of `cuts` between bound fragments, the most firmly bound first.

        Two fragments are bound if they approach, or if their relative motion has too little energy
        to break the bond. The proof that fragments stay apart needs three times the breaking
        energy.
        """
        weights, speeds = self._divide(*self._parts(cuts))
        opening, shares = speeds[1:] - speeds[:-1], 1.0 / weights
        excess = 0.5 / (shares[:-1] + shares[1:]) * opening * np.abs(opening)
        excess += self.bond_energies[cuts] - self.bond.dissociation
        excess = np.where(opening > 0.0, excess, np.minimum(excess, -np.abs(opening)))
        (bound,) = (excess <= 0.0).nonzero()
        return bound[excess[bound].argsort()]

    def cut_at(self, cuts: NDArray[np.int64]) -> Fragments:
        """Return the fragments of the chain with the given cuts."""
        bond = self.bond
        starts, sizes = self._parts(cuts)
        weights, speeds = self._divide(starts, sizes)
        moved = self.displacements if self.unit else self.masses * self.displacements
        means = np.add.reduceat(moved, starts) / weights
        inner, each = self.bond_energies, speeds
        if len(cuts):
            inner, each = inner.copy(), speeds.repeat(sizes)
            inner[cuts] = 0.0
        with np.errstate(over="ignore"):
            halves = 0.5 if self.unit else 0.5 * self.masses
            motion = halves * (self.velocities - each) ** 2
            energies = _ENERGY_RESERVE * np.add.reduceat(motion + inner, starts)
        if self.unit:
            levers = [_unit_levers(size) for size in sizes.tolist()]
        else:
            levers = levers_of(self.masses, starts, sizes)
        if len(cuts) == 0:
            return Fragments(cuts, sizes, self.masses, weights, speeds, energies, means, levers)
        opening = speeds[1:] - speeds[:-1]
        gaps, growths = self._gaps(cuts, levers, means, speeds[:-1], speeds[1:], energies)
        kept = _LEFT * growths
        apart = (gaps >= bond.convex_strain) & (kept > 0.0)
        pulls = _RESERVE * self._pull(gaps, kept, apart)
        worse = self._worsened(energies, pulls, levers)
        later, slower = self._gaps(
            cuts,
            levers,
            means,
            speeds[:-1] + pulls / weights[:-1],
            speeds[1:] - pulls / weights[1:],
            worse,
        )
        apart &= (later >= bond.convex_strain) & (slower >= kept)
        apart &= self._pull(later, kept, apart) <= pulls
        # At cuts without a proof, compute the pull from the present strains and velocities.
        present = self._pull(self.strains[cuts], _LEFT * opening, opening > 0.0)
        worse = self._worsened(energies, np.where(apart, pulls, present), levers)
        return Fragments(cuts, sizes, self.masses, weights, speeds, worse, means, levers, apart)

    def _parts(self, cuts: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the index of the first particle, and the size, of each fragment."""
        ends = np.empty(len(cuts) + 2, dtype=np.int64)
        ends[0], ends[1:-1], ends[-1] = 0, cuts, len(self.velocities)
        ends[1:-1] += 1
        return ends[:-1], ends[1:] - ends[:-1]

    def _divide(self, starts: NDArray[np.int64], sizes: NDArray[np.int64]) -> tuple[Array, Array]:
        """Return the masses and mean velocities of fragments."""
        weights = sizes.astype(float) if self.unit else np.add.reduceat(self.masses, starts)
        return weights, np.add.reduceat(self.momenta, starts) / weights

    def return_risk(self, pieces: Fragments) -> float:
        """Return the probability that ejections at the cuts send the first fragment to the wall."""
        if pieces.apart.all():
            return 0.0
        speeds, energies, levers = pieces.speeds, pieces.energies, pieces.levers
        disturbed = 0.0
        for k in range(len(pieces.cuts) - 1, -1, -1):
            risk = 0.0
            if not pieces.apart[k]:
                opening = float(speeds[k + 1] - speeds[k])
                risk = max(
                    self._escape(float(energy), lever, opening)
                    for energy, lever in (
                        (energies[k], levers[k][1]),
                        (energies[k + 1], levers[k + 1][0]),
                    )
                )
            if disturbed > 0.0:
                risk += disturbed * self._group_escape(pieces.cuts[k] + 1, float(speeds[k]))
            disturbed = min(risk, 1.0)
        return disturbed * self._group_escape(0, 0.0) if disturbed > 0.0 else 0.0

    def _escape(self, energy: float, lever: Lever, speed: float) -> float:
        return escape_risk(self.bond, energy, lever, speed, self.patience)

    def _group_escape(self, start: int, speed: float) -> float:
        """Return the risk that the part that begins at `start` ejects a particle at a speed."""
        velocities, masses = self.velocities[start:], self.masses[start:]
        mean = float(np.sum(self.momenta[start:])) / float(np.sum(masses))
        energy = 0.5 * float(np.sum(masses * (velocities - mean) ** 2))
        energy += float(np.sum(self.bond_energies[start:]))
        lever = equal_lever(len(masses)) if self.unit else Lever.of(masses)
        return self._escape(_ENERGY_RESERVE * energy, lever, mean - speed)

    def _gaps(
        self,
        cuts: NDArray[np.int64],
        levers: list[tuple[Lever, Lever]],
        means: Array,
        behind: Array,
        ahead: Array,
        energies: Array,
    ) -> tuple[Array, Array]:
        """Return lower bounds on the strains of the cut bonds and on their rates of growth."""
        known = energies.tolist()
        far = zip(known[:-1], levers[:-1], strict=True)
        near = zip(known[1:], levers[1:], strict=True)
        last = np.array([self._end(energy, lever[1]) for energy, lever in far])
        first = np.array([self._end(energy, lever[0]) for energy, lever in near])
        # If an end particle is already displaced beyond the computed limit, use its displacement.
        back = np.maximum(last[:, 0], self.displacements[cuts] - means[:-1])
        front = np.maximum(first[:, 0], means[1:] - self.displacements[cuts + 1])
        gaps = (means[1:] - front) - (means[:-1] + back)
        return gaps, ahead - behind - first[:, 1] - last[:, 1]

    def _end(self, energy: float, lever: Lever) -> tuple[float, float]:
        """Return a limit of an end particle's displacement, and its largest speed beyond it."""
        bond, paid = self.bond, PAID * self.bond.dissociation
        if lever.particles == 1:
            return 0.0, 0.0
        if energy < paid:
            return reach(bond, energy, lever), 0.0
        rest = 2.0 * (energy - paid) * lever.rest / lever.whole / lever.mass
        return reach(bond, paid, lever), math.sqrt(rest)

    def _pull(self, gaps: Array, growths: Array, where: NDArray[np.bool_]) -> Array:
        """Return the largest momentum that the pull across each gap can ever give."""
        bond = self.bond
        gaps, growths = np.where(where, gaps, 1.0), np.where(where, growths, 1.0)
        return np.where(where, (bond.dissociation - bond.energy(gaps)) / growths, 0.0)

    def _worsened(self, energies: Array, pulls: Array, levers: list[tuple[Lever, Lever]]) -> Array:
        """Return bounds on the internal energies after the pulls at both ends."""
        sides = np.zeros((2, len(energies)))
        sides[0, 1:] = sides[1, :-1] = pulls
        if not self.unit:
            sides *= np.array([[lever[end].mass for lever in levers] for end in (0, 1)]) ** -0.5
        return 0.5 * (np.sqrt(2.0 * energies) + (sides[0] + sides[1])) ** 2


def levers_of(
    masses: Array, starts: NDArray[np.int64], sizes: NDArray[np.int64]
) -> list[tuple[Lever, Lever]]:
    """Return the levers of both ends of the fragments that begin at `starts`."""
    through, last = np.cumsum(masses), starts + sizes - 1
    whole = np.add.reduceat(masses, starts)
    # `beyond` and `before` are the masses of the fragment after and before each particle.
    beyond = np.repeat(through[last], sizes) - through
    before = np.repeat(whole, sizes) - beyond - masses
    before[starts] = 0.0
    ends = []
    for outer, end, far in ((beyond, starts, last), (before, last, starts)):
        weights = outer / np.repeat(whole, sizes)
        weights[far] = 0.0
        columns = (
            *(sizes, np.add.reduceat(weights, starts), np.add.reduceat(weights**2, starts)),
            *(weights[end], masses[end], whole),
        )
        ends.append(list(starmap(Lever, zip(*(c.tolist() for c in columns), strict=True))))
    return list(zip(*ends, strict=True))


@lru_cache(maxsize=1024)
def _unit_levers(particles: int) -> tuple[Lever, Lever]:
    """Return the levers of both ends of a fragment of particles of mass 1."""
    return levers_of(np.ones(particles), np.zeros(1, np.int64), np.array([particles]))[0]


def count_fragments(
    strains: Array, velocities: Array, bond: Potential, masses: Array | None = None
) -> int:
    """
    Return the number of connected fragments of a chain at one time, at least one.

    A bond counts as broken if it is stretched, its length grows, and the energy U plus the kinetic
    energy of the relative motion exceeds the dissociation energy. The kinetic energy is computed
    with the reduced mass of both particles. `strains` is of shape (n - 1,); `velocities` and
    `masses` (1 by default) are of shape (n,). Beads, which only push, count as one fragment.
    """
    if math.isinf(bond.dissociation) or bond.only_pushes:
        return 1
    opening = velocities[1:] - velocities[:-1]
    reduced = 0.5 if masses is None else 1.0 / (1.0 / masses[1:] + 1.0 / masses[:-1])
    relative = 0.5 * reduced * opening**2 + bond.energy(strains)
    broken = (strains > 0.0) & (opening > 0.0) & (relative > bond.dissociation)
    return 1 + int(np.count_nonzero(broken))
