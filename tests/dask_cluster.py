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
    """A Dask cluster on this machine."""

    address: str  #: Address of the scheduler.
    scheduler: subprocess.Popen  #: Process of the scheduler.
    #: Processes of the nannies; each has its worker as a child process.
    workers: list[subprocess.Popen]


@contextlib.contextmanager
def dask_cluster(workers: int = 2) -> Iterator[DaskProcesses]:
    """
    Start a Dask scheduler and workers as separate processes on loopback.

    Parameters
    ----------
    workers : int
        Number of workers, with one thread each.

    Yields
    ------
    DaskProcesses
        The cluster, which ends with the block.
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
    Return the child processes whose command line contains a text.

    Parameters
    ----------
    parent : int
        Id of the parent process.
    command : str
        Text in the command line.

    Returns
    -------
    list of int
        Ids of the child processes.
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
    Start a process that uses these sources and prints nothing.

    Parameters
    ----------
    command : list of str
        Program and arguments.

    Returns
    -------
    subprocess.Popen
        The process.
    """
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, env=environment, stdout=quiet, stderr=quiet)
