"""Submit tasks to an executor that the user provides."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from typing import Any

from chaincor.lammps_inputs.errors import InputError, one_line
from chaincor.workflows.campaign.carry_out import TASKS_PER_WORKER
from chaincor.workflows.errors import SchedulerError
from chaincor.workflows.given import workers_given

# Attributes with the number of workers: the first one exists in mpi4py's executors, the second one
# in those of Python and loky.
_COUNTS = ("num_workers", "_max_workers")


class GivenExecutor(Executor):
    """Wrapper of a user's executor. Its shutdown leaves the user's executor open."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self._pending: set[Future] = set()

    def submit(self, function: Callable, /, *args: Any, **kwargs: Any) -> Future:
        """Submit a task to the user's executor; raise SchedulerError if the executor refuses it."""
        try:
            future = self._executor.submit(function, *args, **kwargs)
        except RuntimeError as error:
            raise SchedulerError(
                f"the executor takes no tasks ({one_line(error)}). Give an open one"
            ) from None
        self._pending.add(future)
        future.add_done_callback(self._pending.discard)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Cancel the tasks that have not started."""
        for future in list(self._pending):
            future.cancel()


@contextmanager
def tasks_to(
    executor: Any, workers: int | None
) -> Iterator[tuple[Executor, int | Callable[[], int]]]:
    """
    Yield a wrapper of a user's executor or Dask client, and its number of tasks at a time.

    `workers` is the number of the executor's workers. By default, this number is read from the
    executor, or is the number of cores. Raise InputError for other objects.
    """
    if type(executor).__module__ == "distributed.client":
        from chaincor.workflows.campaign.cluster import DaskCluster

        with DaskCluster.of(executor) as cluster:
            yield cluster, cluster.in_flight if workers is None else TASKS_PER_WORKER * workers
        return
    if not isinstance(executor, Executor):
        raise InputError(
            f"executor is an object of type {type(executor).__name__}. Give a "
            "concurrent.futures.Executor or a Dask client"
        )
    known = (getattr(executor, name, None) for name in _COUNTS)
    count = workers or next((each for each in known if isinstance(each, int)), None)
    with GivenExecutor(executor) as given:
        yield given, TASKS_PER_WORKER * workers_given(count)
