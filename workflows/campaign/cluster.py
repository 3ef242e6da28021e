"""Run tasks on the workers of a Dask cluster."""

import contextlib
import importlib.metadata
import logging
import math
import re
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any, Self

from chaincor.lammps_inputs.errors import InputError, one_line
from chaincor.workflows.errors import SchedulerError, WorkerDiedError
from chaincor.workflows.versions import version_of

_CONNECT_SECONDS = 10.0
# A scheduler counts as lost if it does not answer for longer than this.
_PATIENCE_SECONDS = 5.0
# Longest time that closing the client may take. The scheduler then drops the client's tasks by
# itself.
_LEAVE_SECONDS = 1.0
# Seconds between two messages that the scheduler has no workers.
_REPORT_SECONDS = 60.0
# Seconds between two counts of the workers.
_COUNT_SECONDS = 2.0
# Each worker has one running task and one waiting task, which begins without a delay. More waiting
# tasks would leave less work for another sweep on the same store.
_TASKS_PER_CORE = 2
_ADDRESS = re.compile(r"(?:tcp|tls|ucx|ws|wss)://(?:\[[^\]]+\]|[^/:\s]+):\d+")
# Dask, Tornado and asyncio log tracebacks when a connection is lost. This module reports a lost
# connection in one line instead.
_NOISY_LOGGERS = ("distributed", "tornado", "asyncio")


class DaskCluster(Executor):
    """
    Executor that runs tasks on the workers of a Dask scheduler, such as ``tcp://host:8786``.

    Creation waits for the first worker, and reports each minute that it waits. Raise InputError if
    the address has another form. Raise SchedulerError if Dask is not installed, if the scheduler
    does not answer, or if a worker lacks chaincor or has another version of it.
    """

    def __init__(self, address: str) -> None:
        self._follow(_connect(address), address, own=True)

    @classmethod
    def of(cls, client: Any) -> Self:
        """Return an executor for a user's client, which stays open afterwards."""
        cluster = cls.__new__(cls)
        cluster._follow(client, client.scheduler.address, own=False)
        return cluster

    def _follow(self, client: Any, address: str, *, own: bool) -> None:
        self._client, self._own = client, own
        self._pending: dict[Any, tuple[Any, Future]] = {}
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._counted, self._cores = -math.inf, 0
        self._address, self._reported = address, math.inf
        try:
            self._wait_for_workers()
            self._compare_versions()
        except BaseException:
            self.shutdown()
            raise
        self._watch = threading.Thread(target=self._watch_scheduler, daemon=True)
        self._watch.start()

    def _wait_for_workers(self) -> None:
        """Wait until the scheduler has a worker."""
        # An adaptive cluster starts workers only when it has tasks.
        _task = self._client.submit(abs, -1, pure=False)
        while not self._client.ncores():
            if self._client.status != "running":
                raise SchedulerError(_LOST)
            self._report_waiting()
            time.sleep(0.2)
        self._reported = math.inf

    def _report_waiting(self) -> None:
        """Report each minute that the scheduler has no workers; the first report is delayed."""
        now = time.monotonic()
        if self._reported == math.inf:
            self._reported = now - _REPORT_SECONDS + _PATIENCE_SECONDS
        if now - self._reported < _REPORT_SECONDS:
            return
        self._reported = now
        print(
            f"chaincor: {self._address} has no workers; waiting. Start one with "
            f"`dask worker {self._address} --nthreads 1`",
            file=sys.stderr,
        )

    def _compare_versions(self) -> None:
        """Raise SchedulerError if a worker lacks chaincor or has another version of it."""
        own = version_of("chaincor")
        # Workers without chaincor could not load a function of chaincor. This function is therefore
        # from the standard library.
        asked = self._client.run(importlib.metadata.version, "chaincor", on_error="return")
        for worker, version in sorted(asked.items()):
            if isinstance(version, Exception):
                raise SchedulerError(
                    f"the worker {worker} has no chaincor. Install chaincor {own} where the "
                    "workers run"
                )
            if version != own:
                raise SchedulerError(
                    f"the worker {worker} runs chaincor {version}, but this sweep runs {own}. "
                    "Install one version on all machines"
                )

    def in_flight(self) -> int:
        """Return the number of tasks to submit at a time, from the present number of workers."""
        now = time.monotonic()
        if now - self._counted >= _COUNT_SECONDS:
            self._counted = now
            # _watch_scheduler reports a lost scheduler, and fails all pending tasks.
            with contextlib.suppress(OSError):
                self._cores = sum(self._client.ncores().values())
        return _TASKS_PER_CORE * max(1, self._cores)

    def submit(self, function: Callable, /, *args: Any, **kwargs: Any) -> Future:
        """Run a function on a worker; the future fails if the worker or the scheduler is lost."""
        result: Future = Future()
        result.set_running_or_notify_cancel()
        from distributed.protocol import pickle

        # Dask would turn each point of a list into a node of its graph, and the scheduler would
        # keep the nodes of finished tasks. Dask forwards bytes as they are.
        call = pickle.dumps((function, args, kwargs))
        # pure=False, because equal calls in different sweeps are different tasks.
        task = self._client.submit(_call, call, pure=False)
        with self._lock:
            self._pending[task.key] = task, result
        task.add_done_callback(lambda done: self._finish(done, result))
        return result

    def _finish(self, task: Any, result: Future) -> None:
        from distributed import CancelledError, KilledWorker

        if self._stop.is_set():  # the result is no longer needed
            return
        value: Any = None
        error: Exception | None = None
        try:
            value = self._fetched(task)
        except KilledWorker as raised:
            error = WorkerDiedError(one_line(raised))
        except CancelledError:
            error = SchedulerError(_LOST)
        except Exception as raised:
            error = raised if self._client.status == "running" else SchedulerError(_LOST)
        with self._lock:
            self._pending.pop(task.key, None)
            _settle(result, value, error)

    def _fetched(self, task: Any) -> Any:
        """Return the result of a finished task, however long a busy machine takes to send it."""
        from distributed.protocol import pickle

        patience = _CONNECT_SECONDS
        while True:
            try:
                return pickle.loads(task.result(timeout=patience))
            except TimeoutError:
                waits = self._client.status == "running" and not self._stop.is_set()
                if task.status != "finished" or not waits:
                    raise
                patience *= 2.0

    def _watch_scheduler(self) -> None:
        """
        Fail pending tasks when the scheduler is lost, and report when all workers have left.

        Dask itself would wait for ever without a message.
        """
        counted = time.monotonic()
        while not self._stop.wait(0.2):
            if self._client.status == "running":
                if time.monotonic() - counted >= _COUNT_SECONDS:
                    counted = time.monotonic()
                    self._look_for_workers()
                continue
            self._stop.wait(_PATIENCE_SECONDS)
            if self._client.status == "running" or self._stop.is_set():
                continue
            with self._lock:
                for _, result in self._pending.values():
                    _settle(result, None, SchedulerError(_LOST))
                self._pending.clear()
            return

    def _look_for_workers(self) -> None:
        """Report when all workers have left while tasks are pending."""
        with contextlib.suppress(Exception):  # the client's status reports a lost scheduler
            if self._pending and not self._client.ncores():
                self._report_waiting()
            else:
                self._reported = math.inf

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """
        Leave the cluster.

        The scheduler then drops unfinished tasks, whatever the arguments are.
        """
        self._stop.set()
        if self._own:
            self._client.close(timeout=_LEAVE_SECONDS)
            return
        with self._lock:
            tasks = [task for task, _ in self._pending.values()]
            self._pending.clear()
        self._client.cancel(tasks)


def _call(call: bytes) -> bytes:
    """Unpickle a function and its arguments on a worker, call it, and pickle its result."""
    from distributed.protocol import pickle

    function, args, kwargs = pickle.loads(call)
    return pickle.dumps(function(*args, **kwargs))


def _connect(address: str) -> Any:
    """Return a client of the scheduler at an address."""
    if not _ADDRESS.fullmatch(address):
        raise InputError(
            f"the address of the scheduler is {address!r}. Give one such as tcp://HOST:8786, "
            "which `dask scheduler` prints when it starts"
        )
    try:
        import dask
        from distributed import Client, Security
    except ImportError:
        raise SchedulerError(
            "Dask is not installed. Install it for --scheduler: pip install chaincor[cluster]"
        ) from None
    _silence_loggers()
    if address.startswith("tls:") and not Security().get_connection_args("client")["ssl_context"]:
        raise SchedulerError(
            f"Dask has no certificates for {address}. Set distributed.comm.tls in Dask's own "
            "settings"
        )
    # If the scheduler is lost, the sweep must end instead of waiting for results forever.
    dask.config.set({"distributed.comm.timeouts.connect": _CONNECT_SECONDS})
    try:
        return Client(address, timeout=_CONNECT_SECONDS, name="chaincor", set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = one_line(error) or type(error).__name__
        raise SchedulerError(
            f"no Dask scheduler answers at {address} ({reason}). Start one with `dask scheduler`"
        ) from None


def _silence_loggers() -> None:
    """Silence each of Dask's loggers, because each gets its own level when Dask is imported."""
    for name in (*_NOISY_LOGGERS, *logging.root.manager.loggerDict):
        if name.partition(".")[0] in _NOISY_LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


_LOST = (
    "the connection to the Dask scheduler was lost. Finished results are in the store: start a "
    "scheduler and workers, and run the same command again"
)


def _settle(result: Future, value: Any, error: BaseException | None) -> None:
    if result.done():
        return
    if error is None:
        result.set_result(value)
    else:
        result.set_exception(error)
