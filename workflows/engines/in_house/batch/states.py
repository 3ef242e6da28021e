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
    """
    Where collisions of one chain begin.

    Attributes
    ----------
    strains : ndarray of shape (samples, n)
        The gap to the wall, and of the bonds.
    velocities : ndarray of shape (samples, n)
        Positive away from the wall.
    """

    strains: Array
    velocities: Array

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
    """
    What came of many runs.

    Attributes
    ----------
    settled : ndarray of shape (runs,)
        Whether a run was carried to an end; nothing else counts where it was not.
    endless : ndarray of shape (runs,)
        Whether no end was found for as long as collisions are followed: none is by other steps.
    endings : ndarray of shape (runs,)
        How it ended, where that was looked for.
    durations : ndarray of shape (runs,)
        Simulated time from the first contact to the end.
    evaluations : ndarray of shape (runs,)
        Of all bond forces.
    strains, velocities : ndarray of shape (runs, n - 1) and (runs, n)
        Right after the last contact.
    speeds : ndarray of shape (runs,)
        Centre-of-mass velocity then.
    contacts : ndarray of shape (runs, 2, capacity)
        Times since the first contact and incoming speeds.
    counts : ndarray of shape (runs,)
        How many contacts there were.
    lasted : ndarray of shape (runs,)
        Time from the initial state to the end of the last contact.
    bond_min, bond_max : ndarray of shape (runs,)
        Shortest and longest bond up to the last contact.
    energies : ndarray of shape (runs,)
        Of the bonds right after the last contact, in rows.
    seconds : ndarray of shape (runs,)
        Wall-clock time of the integration of each: that of all, in equal parts.
    """

    settled: NDArray[np.bool_]
    endless: NDArray[np.bool_]
    endings: NDArray[np.object_]
    durations: Array
    evaluations: NDArray[np.int64]
    strains: Array
    velocities: Array
    speeds: Array
    contacts: Array
    counts: NDArray[np.int64]
    lasted: Array
    bond_min: Array
    bond_max: Array
    energies: Array
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
