"""One try at one collision: done wherever a worker is, and sent back whole."""

import math
import platform
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from chaincor.lammps_inputs.errors import ChaincorError, InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import MissingLibraryError, RunError, WorkerDiedError
from chaincor.workflows.result import Collision
from chaincor.workflows.store.kept import Kept

# A Dask worker may have several threads; LAMMPS is not made for several at once in one process.
_one_at_a_time = threading.Lock()

# A full disk or no memory costs the collision that met it, not the sweep.
MACHINE_FAILURES = (OSError, MemoryError)


@dataclass(frozen=True)
class Failure:
    """
    Why a collision has no result.

    Attributes
    ----------
    name : str
        Class of the error.
    message : str
        One line.
    stands : bool
        Whether the same scene would fail again: then it is tried anew only on request.
    """

    name: str
    message: str
    stands: bool

    @classmethod
    def from_error(cls, error: BaseException) -> "Failure":
        """
        Describe an error.

        It stands for named errors of the collision itself, not for those of the machine.
        """
        passing = isinstance(error, MissingLibraryError | WorkerDiedError)
        stands = isinstance(error, RunError | InputError) and not passing
        message = " ".join(str(error).split()) or type(error).__name__
        return cls(type(error).__name__, message, stands)


@dataclass(frozen=True)
class Attempt:
    """
    One try at one scene on one host.

    Attributes
    ----------
    scene : Scene
        The scene.
    collision : Collision or None
        Its result.
    failure : Failure or None
        Why there is none.
    host : str
        Where it was tried.
    kept : Kept or None
        Takes the place of the result where hundreds are sent.
    """

    scene: Scene
    collision: Collision | None
    failure: Failure | None
    host: str
    kept: Kept | None = None


@dataclass(frozen=True)
class Company:
    """
    What came of scenes that were carried out together, sent without these.

    Attributes
    ----------
    kept : list of Kept or None
        In their order; None for those that have to be carried out alone.
    host : str
        Where that was.
    """

    kept: list[Kept | None]
    host: str

    def attempts(self, scenes: Sequence[Scene]) -> list[Attempt]:
        """Return those at which something came out."""
        return [
            Attempt(scene, None, None, self.host, kept)
            for scene, kept in zip(scenes, self.kept, strict=True)
            if kept is not None
        ]


@cache
def host_name() -> str:
    """Return the name of this machine in the network, ``unknown`` where it has none."""
    return platform.node() or "unknown"


def carry_out(scene: Scene) -> Attempt:
    """
    Carry out one collision and catch what goes wrong with it.

    Named failures are caught, and those of the machine: no memory, no room for files. Any other
    error is one of the program or of the user's own bond, and stops whatever asked.

    Raises MissingLibraryError if no collision at all can be run here.
    """
    from chaincor.workflows.collision import collide

    try:
        with _one_at_a_time:
            # What a sweep takes is for its forecast to say, not for each collision to refuse.
            collision = collide(scene, most_seconds=math.inf)
    except MissingLibraryError:
        raise
    except (ChaincorError, *MACHINE_FAILURES) as error:
        return Attempt(scene, None, Failure.from_error(error), host_name())
    return Attempt(scene, collision, None, host_name())


def carry_out_together(scenes: Sequence[Scene]) -> Company:
    """
    Carry out collisions of one kind at once.

    Results are as they are kept: hundreds are to be sent, and what takes long is not to be done
    where all of them come together.
    Any failure leaves all of them to be carried out alone, where it gets its name.
    """
    from chaincor.workflows.collision import collide_together

    try:
        with _one_at_a_time:
            found = collide_together(scenes)
    except (ChaincorError, *MACHINE_FAILURES):
        return Company([None] * len(scenes), host_name())
    return Company([None if each is None else Kept.of(each) for each in found], host_name())
