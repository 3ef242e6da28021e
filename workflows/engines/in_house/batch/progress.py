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
    """The chains of a batch, a row for each."""

    ledgers: np.recarray  #: See ``bookkeeping``; of shape (chains,).
    #: Now; of shape (chains, n - 1) and (chains, n).
    strains: Array
    velocities: Array  #: See ``strains``.
    #: The same right after the last contact.
    last_strains: Array
    last_velocities: Array  #: See ``last_strains``.
    #: Times, closing speeds, and the momentum given to the chain; of shape (chains, 3, capacity).
    contacts: Array
    energies: Array  #: Of each chain; of shape (chains,).
    steps: Array  #: H of each; of shape (chains,).
    goals: Counts  #: How many steps shall be done of each; of shape (chains,).
    statuses: Counts  #: Whether it moves, or why it does not; of shape (chains,).


class Queue(NamedTuple):
    """Some chains; the last to come is the first to go."""

    chains: Counts  #: Which, and room for all; of shape (chains,).
    held: Counts  #: How many; of shape (1,).

    @classmethod
    def of(cls, chains: int) -> "Queue":
        """Return an empty one with room for all."""
        return cls(np.zeros(chains, np.int64), np.zeros(1, np.int64))


class Progress(NamedTuple):
    """Where chains are within their steps."""

    #: When the step began, and what is left of it; of shape (chains,).
    begun: Array
    left: Array  #: See ``begun``.
    move: Array  #: Up to where the next move goes; of shape (chains,).
    known: Counts  #: What is known of that; of shape (chains,).
    #: Chains whose contacts have to be searched, and those of which these are found.
    waiting: Queue
    found: Queue  #: See ``waiting``.


class Places(NamedTuple):
    """Which chains are where in a batch, and how far."""

    progress: Progress  #: Of the chains.
    whose: Counts  #: Which chain is in a lane; -1 for none; of shape (L,).
    #: Its smallest and largest strain now; of shape (L,).
    low: Array
    high: Array  #: See ``low``.
    searched: Counts  #: Which chain's contact is searched in a lane; -1 for none; of shape (L,).

    @classmethod
    def of(cls, chains: int) -> "Places":
        """Return those of so many chains, none of which has begun."""
        progress = Progress(
            *(np.zeros(chains), np.zeros(chains), np.zeros(chains), np.zeros(chains, np.int64)),
            *(Queue.of(chains), Queue.of(chains)),
        )
        nobody, low, high = np.full(LANES, -1), np.zeros(LANES), np.zeros(LANES)
        return cls(progress, nobody, low, high, nobody.copy())
