"""What collisions will take: time from the measured cost model, and room on the disk."""

from collections.abc import Sequence
from dataclasses import dataclass

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.work import tasks_of
from chaincor.workflows.versions import cores_allowed

# From the command to the first collision: imports, processes, compiled code that is loaded.
_START_SECONDS = 2.5
# A row with its key in the index, and what an array in NumPy's format adds to its numbers.
_ROW_BYTES = 2500
_ARRAY_BYTES = 5 * 230


@dataclass(frozen=True)
class Forecast:
    """
    What collisions are expected to take, on a machine that does nothing else.

    Right within a factor of two for nearly every collision that computes, of four for chains that
    fall to pieces, better for many.
    """

    points: int  #: Collisions to compute.
    #: Sum of their times on one core, and the time of the longest.
    seconds: float
    longest: float  #: See ``seconds``.
    disk_bytes: int  #: Growth of the store.

    @classmethod
    def of(cls, scenes: Sequence[Scene], *, arrays: bool = False) -> "Forecast":
        """Forecast collisions, with or without their arrays."""
        costs = [cost for task in tasks_of(scenes, 1) for cost in task.costs]
        # Contacts hardly exceed particles; two arrays of contacts, three of particles.
        sizes = [_ARRAY_BYTES + 5 * 8 * scene.particles for scene in scenes if arrays]
        room = _ROW_BYTES * len(scenes) + sum(sizes)
        return cls(len(scenes), sum(costs), max(costs, default=0.0), room)

    def wall_seconds(self, workers: int) -> float:
        """Return the time on several workers, each of which has its share of the cores allowed."""
        if self.points == 0:
            return 0.0
        together = min(workers, cores_allowed())
        return _START_SECONDS + max(self.seconds / together, self.longest)
