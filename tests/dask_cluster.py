"""Start a real Dask cluster for tests, with scheduler and workers in separate processes."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


@dataclass
class DaskProcesses:
    """A cluster on this machine."""

    address: str  #: Of the scheduler.
    scheduler: subprocess.Popen  #: Its process.
    workers: list[subprocess.Popen]  #: The nannies, each with the process of its worker below it.


@contextlib.contextmanager
def dask_cluster(workers: int = 2) -> Iterator[DaskProcesses]:
    """
    Start a Dask scheduler and workers as separate processes on loopback.

    Parameters
    ----------
    workers : int
        How many, with one thread each.

    Yields
    ------
    DaskProcesses
        Ended when the block is left, whatever has happened to it.
    """
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", address]
    with tempfile.TemporaryDirectory(prefix="dask-") as folder:
        scheduler = start_quietly(
            [*dask, "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
        )
        options = ["--nthreads", "1", "--no-dashboard", "--local-directory", folder]
        crew = [start_quietly([*worker, *options]) for _ in range(workers)]
        try:
            _wait_for_workers(address, workers)
            yield DaskProcesses(address, scheduler, crew)
        finally:
            grandchildren = [c for w in crew for c in children(w.pid, "spawn_main")]
            for process in (*crew, scheduler):
                process.kill()
                process.wait()
            for pid in grandchildren:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)


def _wait_for_workers(address: str, count: int) -> None:
    from distributed import Client

    with Client(address, timeout=600, set_as_default=False) as client:
        if count:
            client.wait_for_workers(count, timeout=600)


def children(parent: int, command: str) -> list[int]:
    """
    Return the processes below another, as far as their command line holds a text.

    Parameters
    ----------
    parent : int
        Process id.
    command : str
        The text.

    Returns
    -------
    list of int
        Process ids.
    """
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            above = int(entry.read_text().rpartition(")")[2].split()[1])
            line = (entry.parent / "cmdline").read_bytes().decode(errors="replace")
            if above == parent and command in line:
                found.append(int(entry.parent.name))
    return found


def start_quietly(command: list[str]) -> subprocess.Popen:
    """
    Start a process that uses these sources and says nothing.

    Parameters
    ----------
    command : list of str
        What to run.

    Returns
    -------
    subprocess.Popen
        The process.
    """
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, env=environment, stdout=quiet, stderr=quiet)
