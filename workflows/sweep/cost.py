"""What collisions will take: time from the measured cost model, and room on the disk."""

from collections.abc import Sequence
from dataclasses import dataclass

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.at_once.together import companies
from chaincor.workflows.accuracy.expected_cost import expected_of_task
from chaincor.workflows.versions import cores_allowed

# From the command to the first collision: imports, processes, compiled code that is loaded.
_START_SECONDS = 2.5
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

    def wall_seconds(self, workers: int) -> float:
        """Return the time on several workers, each of which has its share of the cores allowed."""
        if self.points == 0:
            return 0.0
        together = min(workers, cores_allowed())
        return _START_SECONDS + max(self.seconds / together, self.longest)


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
