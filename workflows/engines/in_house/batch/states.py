"""Where the collisions of a batch begin, and what came of them."""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line


@dataclass(frozen=True)
class Rows:
    """Arrays with a row for each of many collisions."""

    def chosen(self, which: NDArray) -> Self:
        """Return some of them."""
        return type(self)(*(getattr(self, f.name)[which] for f in fields(self)))


@dataclass(frozen=True)
class StartStates(Rows):
    """Where collisions of one chain begin."""

    strains: Array  #: The gap to the wall, and of the bonds; of shape (samples, n).
    velocities: Array  #: Positive away from the wall; of shape (samples, n).

    @classmethod
    def of(cls, lines: list[Line]) -> "StartStates":
        """Return those of lines with a rigid wall."""
        return cls(
            np.array([line.strains for line in lines]),
            np.array([line.velocities[1:] for line in lines]),
        )

    @classmethod
    def cold(cls, speeds: Array, particles: int) -> "StartStates":
        """Return chains at the wall that come with these speeds."""
        strains = np.zeros((len(speeds), particles))
        return cls(strains, np.repeat(-speeds[:, None], particles, axis=1))

    def __len__(self) -> int:
        return len(self.strains)


@dataclass(frozen=True)
class ManyRuns(Rows):
    """What came of many runs."""

    #: Whether a run was carried to an end; nothing else counts where it was not; of shape (runs,).
    settled: NDArray[np.bool_]
    #: Whether no end was found for as long as collisions are followed: none is by other steps; of
    #: shape (runs,).
    endless: NDArray[np.bool_]
    endings: NDArray[np.object_]  #: How it ended, where that was looked for; of shape (runs,).
    durations: Array  #: Simulated time from the first contact to the end; of shape (runs,).
    evaluations: NDArray[np.int64]  #: Of all bond forces; of shape (runs,).
    #: Right after the last contact; of shape (runs, n - 1) and (runs, n).
    strains: Array
    velocities: Array  #: See ``strains``.
    speeds: Array  #: Centre-of-mass velocity then; of shape (runs,).
    #: Times since the first contact and incoming speeds; of shape (runs, 2, capacity).
    contacts: Array
    counts: NDArray[np.int64]  #: How many contacts there were; of shape (runs,).
    lasted: Array  #: Time from the initial state to the end of the last contact; of shape (runs,).
    #: Shortest and longest bond up to the last contact; of shape (runs,).
    bond_min: Array
    bond_max: Array  #: See ``bond_min``.
    energies: Array  #: Of the bonds right after the last contact, in rows; of shape (runs,).
    #: Wall-clock time of the integration of each: that of all, in equal parts; of shape (runs,).
    seconds: Array

    @property
    def displacements(self) -> Array:
        """The same as ``strains``, u_i = x_i - (i - 1), of shape (runs, n)."""
        zeros = np.zeros((len(self.strains), 1))
        return np.cumsum(np.concatenate((zeros, self.strains), axis=1), axis=1)

    @property
    def listed(self) -> NDArray[np.bool_]:
        """Which places of `contacts` hold one, of shape (runs, capacity)."""
        return np.arange(self.contacts.shape[2]) < self.counts[:, None]

    @property
    def last_contact_times(self) -> Array:
        """When particle 1 left the wall."""
        return self.contacts[np.arange(len(self.counts)), 0, self.counts - 1]

    @property
    def longest_silences(self) -> Array:
        """The longest time between two contacts of each; 0 where there is but one."""
        gaps = np.diff(self.contacts[:, 0], axis=1)
        return np.asarray(np.max(gaps, axis=1, where=self.listed[:, 1:], initial=0.0))

    @property
    def proved(self) -> NDArray[np.bool_]:
        """Whether an end is proved; argued otherwise."""
        kinds = [ending is not None and ending.kind == "proved" for ending in self.endings]
        return np.array(kinds, bool)


def chain_energies(line: Line, bond: Potential, starts: StartStates) -> Array:
    """Return the energy of each chain, of shape (samples,)."""
    motion = 0.5 * each_sum(starts.velocities**2 * line.chain_masses)
    return motion + np.sum(bond.energy(starts.strains[:, 1:]), axis=1)


def each_sum(terms: Array) -> Array:
    """Return the sum of each row; a matrix product may round a row as the number of rows is."""
    return np.asarray(np.sum(terms, axis=1))
