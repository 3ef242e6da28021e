"""A Dask cluster as an executor: the same tasks, carried out on other machines."""

import logging
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

from chaincor.lammps_inputs.errors import one_line
from chaincor.workflows.errors import SchedulerError, WorkerDiedError

_CONNECT_SECONDS = 10.0
# A scheduler that is gone for longer than this is lost.
_PATIENCE_SECONDS = 5.0
# Enough to keep a thousand cores busy while results are being written.
_LEAST_IN_FLIGHT = 1000


class DaskCluster(Executor):
    """
    An executor whose tasks run on the workers of a Dask scheduler, at ``tcp://host:8786`` or so.

    Raises SchedulerError if Dask is not installed or the scheduler does not answer.
    """

    def __init__(self, address: str) -> None:
        try:
            import dask
            from distributed import Client
        except ImportError:
            raise SchedulerError(
                "Dask is not installed; expected it for --scheduler: pip install chaincor[cluster]"
            ) from None
        # Dask would log tracebacks of what is told in one line here.
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        # A lost scheduler must end the sweep, not leave it waiting for results for ever.
        dask.config.set({"distributed.comm.timeouts.connect": _CONNECT_SECONDS})
        try:
            self._client = Client(
                address, timeout=_CONNECT_SECONDS, name="chaincor", set_as_default=False
            )
        except (OSError, ValueError) as error:
            reason = one_line(error) or type(error).__name__
            raise SchedulerError(
                f"no Dask scheduler answers at {address} ({reason}); expected one started by "
                "`dask scheduler`"
            ) from None
        self._pending: dict[Any, Future] = {}
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._watch = threading.Thread(target=self._watch_scheduler, daemon=True)
        self._watch.start()

    @property
    def in_flight(self) -> int:
        """Tasks to hand out at a time."""
        return max(_LEAST_IN_FLIGHT, 2 * sum(self._client.ncores().values()))

    def submit(self, function: Callable, /, *args: Any, **kwargs: Any) -> Future:
        """Run a function on a worker; WorkerDiedError or SchedulerError if one is lost over it."""
        result: Future = Future()
        result.set_running_or_notify_cancel()
        # Not pure: equal calls of different sweeps are not the same task.
        task = self._client.submit(function, *args, pure=False, **kwargs)
        with self._lock:
            self._pending[task.key] = result
        task.add_done_callback(lambda done: self._finish(done, result))
        return result

    def _finish(self, task: Any, result: Future) -> None:
        from distributed import CancelledError, KilledWorker

        value: Any = None
        error: Exception | None = None
        try:
            value = task.result(timeout=_CONNECT_SECONDS)
        except KilledWorker as raised:
            error = WorkerDiedError(one_line(raised))
        except CancelledError:
            error = SchedulerError(_LOST)
        except Exception as raised:
            error = raised if self._client.status == "running" else SchedulerError(_LOST)
        with self._lock:
            self._pending.pop(task.key, None)
            _settle(result, value, error)

    def _watch_scheduler(self) -> None:
        """Fail what is pending when the scheduler stays away: Dask itself would wait for ever."""
        while not self._stop.wait(0.2):
            if self._client.status == "running":
                continue
            self._stop.wait(_PATIENCE_SECONDS)
            if self._client.status == "running" or self._stop.is_set():
                continue
            with self._lock:
                for result in self._pending.values():
                    _settle(result, None, SchedulerError(_LOST))
                self._pending.clear()
            return

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster; it drops unfinished tasks, whatever the arguments."""
        self._stop.set()
        self._client.close(timeout=_PATIENCE_SECONDS)


_LOST = (
    "the connection to the Dask scheduler was lost; what is finished is in the store: start a "
    "scheduler and run the same command again"
)


def _settle(result: Future, value: Any, error: BaseException | None) -> None:
    if result.done():
        return
    if error is None:
        result.set_result(value)
    else:
        result.set_exception(error)
