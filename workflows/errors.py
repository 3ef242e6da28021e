"""Named failures of a run, with messages that say what to do."""

from chaincor.lammps_inputs.errors import ChaincorError as ChaincorError
from chaincor.lammps_inputs.errors import InputError as InputError


class RunError(ChaincorError):
    """A run could not produce a trustworthy number."""


class MissingLibraryError(RunError):
    """LAMMPS, its MPI library, or one of its packages is missing."""


class LammpsError(RunError):
    """LAMMPS stopped with an error that has no named class."""


class BondRangeError(RunError):
    """A bond left the range of its table."""

    length: float = float("nan")  #: Length of the bond.


class LostAtomsError(RunError):
    """LAMMPS lost particles, or a coordinate is not a number."""


class CrossingError(RunError):
    """Two particles would pass through each other, which LAMMPS cannot represent."""


class BarrierError(RunError):
    """A bond was stretched over its energy barrier and runs away to minus infinity."""


class TimestepError(RunError):
    """The step is too large for the bonds it has to resolve."""


class UnfinishedCollisionError(RunError):
    """The cap on the length of a collision was reached and hits may still come."""


class ToleranceError(RunError):
    """The tolerance is missed by so much that no number is worth the run."""


class UnsureJobWarning(UserWarning):
    """The collision of a job amplifies small errors so much that the job misses its tolerance."""


class StoreError(InputError):
    """A results store cannot be used: no such file, not a store, read-only, or too new."""


class StoreWriteError(RunError):
    """A result could not be written to the store: a full disk, or a lock that does not end."""


class SweepError(InputError):
    """A sweep file asks for axes or settings that make no sense."""


class CostError(InputError):
    """A collision is expected to exceed its time, or exceeded it without a number yet."""


class WorkerDiedError(RunError):
    """The process that ran a collision died: killed, out of memory, or aborted by a library."""


class WorkerStartError(RunError):
    """No worker process starts, so no collision can be run."""


class SchedulerError(RunError):
    """The cluster's scheduler cannot be reached, or was lost during a sweep."""


class SensitivityError(RunError):
    """Eta has no computable derivative: the motion cannot be linearised."""
