"""What collisions will take: time from the measured cost model, and room on the disk."""

import os
from collections.abc import Sequence
from dataclasses import dataclass

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.at_once.together import companies
from chaincor.workflows.accuracy.expected_cost import expected_of_task
from chaincor.workflows.versions import cores_allowed

# From the command to the first collision: imports, processes, compiled code that is loaded.
_START_SECONDS = 2.5
# Where many share a core, a second of it does less: caches and halves of a core are shared, too.
# At a load of 12 to 15 on two cores, two sweeps took 1.8 and 1.95 times what the shares alone say.
_CROWDING = 0.5
# Processes that run on average on a machine that nobody uses, this program's start among them.
_ALWAYS = 0.5
# A row with its key in the index, and what an array in NumPy's format adds to its numbers.
_ROW_BYTES = 2500
_ARRAY_BYTES = 5 * 230


@dataclass(frozen=True)
class SweepCost:
    """
    What a sweep is expected to take.

    Attributes
    ----------
    points : int
        Collisions to compute.
    seconds : float
        Sum of their times on one core.
    longest : float
        Time of the longest.
    disk_bytes : int
        Growth of the store.
    """

    points: int
    seconds: float
    longest: float
    disk_bytes: int

    def wall_seconds(self, workers: int, share: float = 1.0) -> float:
        """
        Return the time on several workers with their start, at least that of the longest.

        `share` is the part of a core that each has: see :func:`share_of_core`.
        """
        if self.points == 0:
            return 0.0
        return (_START_SECONDS + max(self.seconds / workers, self.longest)) / share


def share_of_core(workers: int, others: float | None = None) -> float:
    """
    Return the part of a core that each of several workers gets, if others go on as they do.

    Processes that want to run share the cores alike. `others` says how many those of others are: by
    default as many as ran or waited on average of the last minute, none where the system does not
    tell (Windows).
    """
    if others is None:
        load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
        others = max(load - _ALWAYS, 0.0)
    share = min(1.0, cores_allowed() / (others + workers))
    return share / (1.0 + _CROWDING * (1.0 - share))


def sweep_cost(scenes: Sequence[Scene], *, arrays: bool = False) -> SweepCost:
    """
    Estimate what collisions will take.

    Right within a factor of two for nearly every collision that computes, of four for chains that
    fall to pieces, better for many, in seconds of a core that nobody else uses.
    """
    seconds: list[float] = []
    for places in companies(scenes, 1):
        seconds += expected_of_task([scenes[place] for place in places])
    room = _ROW_BYTES * len(scenes)
    if arrays:
        # Contacts hardly exceed particles; two arrays of contacts, three of particles.
        room += sum(_ARRAY_BYTES + 5 * 8 * scene.particles for scene in scenes)
    return SweepCost(len(scenes), sum(seconds), max(seconds, default=0.0), room)
