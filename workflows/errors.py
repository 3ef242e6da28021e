"""Define the named errors of runs."""

from chaincor.lammps_inputs.errors import ChaincorError as ChaincorError
from chaincor.lammps_inputs.errors import InputError as InputError


class RunError(ChaincorError):
    """A run could not produce a trustworthy result."""


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
    """Two particles would pass through each other, and LAMMPS has no such motion."""


class BarrierError(RunError):
    """A bond was stretched over its energy barrier, beyond which its energy falls."""


class TimestepError(RunError):
    """The time step is too large to resolve the bonds."""


class UnfinishedCollisionError(RunError):
    """The collision reached its time limit, and further contacts are possible."""


class ToleranceError(RunError):
    """The error would be so large that a run is useless."""


class UnsureJobWarning(UserWarning):
    """A job will miss its tolerance, because its collision amplifies small errors."""


class StoreError(InputError):
    """A results store cannot be used, because it is missing, read-only, too new, or no store."""


class StoreWriteError(RunError):
    """A result could not be written, because the disk is full or the store stays locked."""


class SweepError(InputError):
    """A sweep file asks for axes or settings that make no sense."""


class CostError(InputError):
    """A collision is expected to exceed its time limit, or reached the limit without a result."""


class WorkerDiedError(RunError):
    """The process that ran a collision was killed, ran out of memory, or was aborted."""


class WorkerStartError(RunError):
    """No worker process starts; therefore no collision can be run."""


class SchedulerError(RunError):
    """The scheduler of the cluster cannot be reached, or its connection was lost in a sweep."""


class SensitivityError(RunError):
    """Eta has no computable derivative: the motion cannot be linearised."""
