"""Where many collisions of one chain begin, and what came of them."""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line

Array = NDArray[np.float64]


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

    def __len__(self) -> int:
        return len(self.strains)


@dataclass(frozen=True)
class ManyOutcomes(Rows):
    """
    What came of many collisions.

    Attributes
    ----------
    settled : ndarray of shape (samples,)
        Whether a collision was carried to an end; nothing else counts where it was not.
    endless : ndarray of shape (samples,)
        Whether no end was found for as long as collisions are followed: none is by other steps.
    proved : ndarray of shape (samples,)
        Whether its end is proved; argued otherwise.
    speeds : ndarray of shape (samples,)
        Centre-of-mass velocity afterwards.
    contacts : ndarray of shape (samples,)
        How many there were.
    last_contact_times : ndarray of shape (samples,)
        From the first contact.
    silent : ndarray of shape (samples,)
        Whether two contacts were farther apart than the quiet time of an argued end.
    bond_min, bond_max : ndarray of shape (samples,)
        Shortest and longest bond up to the last contact.
    """

    settled: NDArray[np.bool_]
    endless: NDArray[np.bool_]
    proved: NDArray[np.bool_]
    speeds: Array
    contacts: NDArray[np.int64]
    last_contact_times: Array
    silent: NDArray[np.bool_]
    bond_min: Array
    bond_max: Array


def chain_energies(line: Line, bond: Potential, starts: StartStates) -> Array:
    """Return the energy of each chain, of shape (samples,)."""
    motion = 0.5 * each_sum(starts.velocities**2 * line.chain_masses)
    return motion + np.sum(bond.energy(starts.strains[:, 1:]), axis=1)


def each_sum(terms: Array) -> Array:
    """Return the sum of each row; a matrix product may round a row as the number of rows is."""
    return np.asarray(np.sum(terms, axis=1))
