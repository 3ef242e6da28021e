"""Tasks: which collisions one worker carries out at a time, and the call that does it."""

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.at_once.together import companies
from chaincor.workflows.accuracy.expected_cost import expected_of_task
from chaincor.workflows.errors import MissingLibraryError
from chaincor.workflows.one_collision import collide_one, collide_together
from chaincor.workflows.result import Collision
from chaincor.workflows.store.row import Row

# What is predicted to take longer than a day is refused, unless it is asked for.
MOST_SECONDS = 86400.0
# A full disk or no memory costs the collision that met it, not the others.
MACHINE_FAILURES = (OSError, MemoryError)
# A Dask worker may have several threads; LAMMPS is not made for several at once in one process.
_one_at_a_time = threading.Lock()

Work = Callable[[Any], Sequence[Any]]


@dataclass(frozen=True)
class Task:
    """
    Collisions that one worker carries out.

    Attributes
    ----------
    places : sequence of int
        Where their scenes stand among all that are asked for.
    scenes : sequence of Scene
        What collides.
    costs : sequence of float
        Seconds that each is expected to take.
    work : callable
        Is given the scenes and returns what came of each: a result, the error that it failed with,
        or None where it has to be carried out alone.
    """

    places: Sequence[int]
    scenes: Sequence[Scene]
    costs: Sequence[float]
    work: Work

    def part(self, chosen: Sequence[int]) -> Self:
        """Return a task for some of the collisions, counted from 0."""
        return replace(
            self,
            places=[self.places[k] for k in chosen],
            scenes=[self.scenes[k] for k in chosen],
            costs=[self.costs[k] for k in chosen],
        )


def collide_scenes(scenes: Sequence[Scene]) -> list[Collision | Exception | None]:
    """
    Carry out one collision, or several of a kind at once; this runs wherever a worker is.

    Named failures are returned, and those of the machine: no memory, no room for files. Where
    several fail, each has to be carried out alone, and gets its own error. Any other error is one
    of the program or of the user's own bond, and stops whatever asked.

    Raises MissingLibraryError if no collision at all can be run here.
    """
    try:
        with _one_at_a_time:
            if len(scenes) > 1:
                return [*collide_together(scenes)]
            # What many collisions take is forecast for all; none is refused on the way.
            return [collide_one(scenes[0], math.inf)]
    except MissingLibraryError:
        raise
    except (ChaincorError, *MACHINE_FAILURES) as error:
        return [error] if len(scenes) == 1 else [None] * len(scenes)


def collide_to_rows(scenes: Sequence[Scene]) -> list[Row | None]:
    """Do the same for a store: what takes long is not left to where all rows come together."""
    return [None if each is None else Row.of(each) for each in collide_scenes(scenes)]


def tasks_of(
    scenes: Sequence[Scene],
    parts: int,
    work: Work = collide_scenes,
    places: Sequence[int] | None = None,
) -> list[Task]:
    """
    Share collisions out: those to be carried out together, and each of the others by itself.

    Those of a kind are divided into `parts` at least, if they are enough. What comes of a
    collision does not depend on it.
    """
    numbers = range(len(scenes)) if places is None else places
    tasks = []
    for company in companies(scenes, parts):
        chosen = [scenes[k] for k in company]
        given = [numbers[k] for k in company]
        tasks.append(Task(given, chosen, expected_of_task(chosen), work))
    return tasks
