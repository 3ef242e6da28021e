"""The chains of a batch, and where they are within their steps."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.in_house.batch.lanes import LANES

Counts = NDArray[np.int64]

# Not left yet; otherwise why it was, see ``bookkeeping``. Beyond that: its end was proved by the
# loop, none is found, one was.
MOVING = -1
PROVED, ENDLESS, ENDED = 5, 6, 7

# What is known of a chain's next move: nothing; that a contact ends it, or none; and that none
# does, which the same move had to show.
OPEN, MEETS, FREE, REPEATED = range(4)


class ChainRows(NamedTuple):
    """
    The chains of a batch, a row for each.

    Attributes
    ----------
    ledgers : recarray of shape (chains,)
        See ``bookkeeping``.
    strains, velocities : ndarray of shape (chains, n - 1) and (chains, n)
        Now.
    last_strains, last_velocities : ndarray
        The same right after the last contact.
    contacts : ndarray of shape (chains, 3, capacity)
        Times, closing speeds, and the momentum given to the chain.
    energies : ndarray of shape (chains,)
        Of each chain.
    steps : ndarray of shape (chains,)
        H of each.
    goals : ndarray of shape (chains,)
        How many steps shall be done of each.
    statuses : ndarray of shape (chains,)
        Whether it moves, or why it does not.
    """

    ledgers: np.recarray
    strains: Array
    velocities: Array
    last_strains: Array
    last_velocities: Array
    contacts: Array
    energies: Array
    steps: Array
    goals: Counts
    statuses: Counts


class Queue(NamedTuple):
    """
    Some chains; the last to come is the first to go.

    Attributes
    ----------
    chains : ndarray of shape (chains,)
        Which, and room for all.
    held : ndarray of shape (1,)
        How many.
    """

    chains: Counts
    held: Counts

    @classmethod
    def of(cls, chains: int) -> "Queue":
        """Return an empty one with room for all."""
        return cls(np.zeros(chains, np.int64), np.zeros(1, np.int64))


class Progress(NamedTuple):
    """
    Where chains are within their steps.

    Attributes
    ----------
    begun, left : ndarray of shape (chains,)
        When the step began, and what is left of it.
    move : ndarray of shape (chains,)
        Up to where the next move goes.
    known : ndarray of shape (chains,)
        What is known of that.
    waiting, found : Queue
        Chains whose contacts have to be searched, and those of which these are found.
    """

    begun: Array
    left: Array
    move: Array
    known: Counts
    waiting: Queue
    found: Queue


class Places(NamedTuple):
    """
    Which chains are where in a batch, and how far.

    Attributes
    ----------
    progress : Progress
        Of the chains.
    whose : ndarray of shape (L,)
        Which chain is in a lane; -1 for none.
    low, high : ndarray of shape (L,)
        Its smallest and largest strain now.
    searched : ndarray of shape (L,)
        Which chain's contact is searched in a lane; -1 for none.
    """

    progress: Progress
    whose: Counts
    low: Array
    high: Array
    searched: Counts

    @classmethod
    def of(cls, chains: int) -> "Places":
        """Return those of so many chains, none of which has begun."""
        progress = Progress(
            *(np.zeros(chains), np.zeros(chains), np.zeros(chains), np.zeros(chains, np.int64)),
            *(Queue.of(chains), Queue.of(chains)),
        )
        nobody, low, high = np.full(LANES, -1), np.zeros(LANES), np.zeros(LANES)
        return cls(progress, nobody, low, high, nobody.copy())
