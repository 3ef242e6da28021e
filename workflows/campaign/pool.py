"""Run tasks in processes; if a process dies, only its task fails."""

import contextlib
import multiprocessing
import os
import pickle
import shutil
import signal
import tempfile
import threading
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from multiprocessing.connection import Connection, wait
from typing import Any

from chaincor.lammps_inputs.errors import ChaincorError, one_line
from chaincor.workflows.errors import SweepError, WorkerDiedError, WorkerStartError

_spawn = multiprocessing.get_context("spawn")


class ProcessPool(Executor):
    """
    Executor whose workers are newly spawned processes.

    The standard library's executors fail completely when one process dies. Here each process has
    its own thread. If a process dies, its task fails, and a new process replaces it. The error
    gives the signal or the exit status.
    """

    def __init__(self, workers: int) -> None:
        self._threads = ThreadPoolExecutor(workers, thread_name_prefix="chaincor-worker")
        self._lock = threading.Lock()
        self._workers: dict[int, _Worker] = {}  # keys are threads
        self._closed = False
        # If workers are killed, their files are removed with this folder.
        self._folder = tempfile.mkdtemp(prefix="chaincor-sweep-")

    def submit(self, function: Callable, /, *args: Any, **kwargs: Any) -> Future:
        """
        Run an importable function in a worker.

        If the worker dies, the future has WorkerDiedError.
        """
        return self._threads.submit(self._call, function, args, kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """
        End the workers.

        If `wait` is true, running tasks finish first; otherwise they are killed.
        """
        if not wait:
            with self._lock:
                self._closed = True
                for worker in self._workers.values():
                    worker.kill()
        self._threads.shutdown(wait=True, cancel_futures=cancel_futures or not wait)
        with self._lock:
            self._closed = True
            for worker in self._workers.values():
                worker.close()
            self._workers.clear()
        shutil.rmtree(self._folder, ignore_errors=True)

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """End the workers; after an error or interrupt, kill running tasks."""
        self.shutdown(wait=kind is None)

    def _call(self, function: Callable, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        thread = threading.get_ident()
        worker = self._workers.get(thread)
        if worker is None or not worker.alive:
            with self._lock:
                if dead := self._workers.pop(thread, None):
                    dead.close()
                if self._closed:
                    raise WorkerDiedError("the pool is closed")
                worker = self._workers[thread] = _Worker(self._folder)
            worker.wait_until_up()
        return worker.call(function, args, kwargs)


class _Worker:
    """Process, and the pipe to it."""

    def __init__(self, folder: str) -> None:
        self._pipe, theirs = _spawn.Pipe()
        self._process = _spawn.Process(target=_serve, args=(theirs, folder), daemon=True)
        self._process.start()
        theirs.close()

    def wait_until_up(self) -> None:
        try:
            self._receive()
        except WorkerDiedError:
            if self._process.exitcode is not None and self._process.exitcode < 0:
                raise
            raise WorkerStartError(
                f"worker processes do not start (exit status {self._process.exitcode}). In "
                'your script, put the call of chaincor under if __name__ == "__main__":, so that '
                "workers can import the script"
            ) from None

    @property
    def alive(self) -> bool:
        return self._process.is_alive()

    def call(self, function: Callable, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        with sent("a task", "a worker process", SweepError):
            task = pickle.dumps((function, args, kwargs))
        try:
            self._pipe.send_bytes(task)
        except ConnectionError:
            raise WorkerDiedError(self._exit_message()) from None
        value, error = self._receive()
        if error is not None:
            raise error
        return value

    def _receive(self) -> tuple[Any, BaseException | None]:
        try:
            # The sentinel reports the worker's death even if another process has inherited the
            # worker's end of the pipe and keeps it open.
            if self._pipe in wait([self._pipe, self._process.sentinel]):
                return self._pipe.recv()
        except (EOFError, OSError):  # an incomplete answer raises an OSError
            pass
        raise WorkerDiedError(self._exit_message())

    def _exit_message(self) -> str:
        self._process.join()
        status = self._process.exitcode or 0
        if status >= 0:
            return f"the worker process ended with exit status {status}: a library aborted it"
        name = signal.Signals(-status).name
        hint = ", as a system does that runs out of memory" if name == "SIGKILL" else ""
        return f"the worker process was killed by {name}{hint}"

    def kill(self) -> None:
        self._process.kill()

    def close(self) -> None:
        self._pipe.close()  # an idle worker ends when its pipe is closed
        self._process.join()
        self._process.close()


def _serve(pipe: Connection, folder: str) -> None:
    """Run tasks from the pipe until the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the main process handles Ctrl-C
    threading.Thread(target=_leave_with_parent, args=(folder,), daemon=True).start()
    tempfile.tempdir = folder
    pipe.send((None, None))  # tells the main process that this worker is ready
    while True:
        try:
            function, args, kwargs = pipe.recv()
        except EOFError:
            # The main process closed the pipe or was killed.
            _leave_with_parent(folder, patience=0.1)
            return
        with contextlib.suppress(BrokenPipeError):
            pipe.send_bytes(_answer(function, args, kwargs))


def _answer(function: Callable, args: tuple[Any, ...], kwargs: dict[str, Any]) -> bytes:
    """Return a pickled pair: the value or None, and the error or None."""
    try:
        # Pickling the value here turns a value that cannot be pickled into an ordinary error.
        return pickle.dumps((function(*args, **kwargs), None))
    except Exception as error:
        # Pickling drops the traceback but keeps notes, so the traceback is added as a note.
        story = "".join(traceback.format_exception(error))
        error.add_note(f"In the worker process:\n{story}")
        try:
            answer = pickle.dumps((None, error))
            pickle.loads(answer)  # some errors can be pickled but not unpickled
        except Exception:
            answer = pickle.dumps((None, RuntimeError(f"in the worker process:\n{story}")))
        return answer


def _leave_with_parent(folder: str, patience: float | None = None) -> None:
    """End this process when the main process ends, even during a task."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    if not wait([parent.sentinel], timeout=patience):
        return
    # A main process that was killed could not end this process.
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(1)


@contextlib.contextmanager
def sent(what: str, to: str, error: type[ChaincorError]) -> Iterator[None]:
    """If pickling fails inside the block, raise `error` instead."""
    try:
        yield
    except (pickle.PicklingError, AttributeError, TypeError) as reason:
        raise error(
            f"{what} cannot be sent to {to} ({one_line(reason)}). Define the functions of "
            "bonds at the top level of a module"
        ) from None
