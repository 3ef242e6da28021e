"""Test that the death of a worker process loses only its current task."""

import gc
import os
import pickle
import signal
import struct
import subprocess
import sys
import threading
import time
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from chaincor.workflows.campaign.pool import ProcessPool
from chaincor.workflows.errors import SweepError, WorkerDiedError
from tests.waiting import HANGS, wait_until


@pytest.fixture(scope="module")
def pool():
    with ProcessPool(2) as opened:
        yield opened


def test_results_and_errors_come_back(pool):
    assert pool.submit(divmod, 7, 3).result() == (2, 1)
    with pytest.raises(ZeroDivisionError):
        pool.submit(divmod, 7, 0).result()


def unsendable():
    return lambda: None


class Odd(Exception):
    """Object that can be pickled but not unpickled."""

    def __init__(self, one, two):
        super().__init__(one)


def raise_odd():
    raise Odd(1, 2)


def test_what_cannot_be_sent_is_an_error_and_not_a_death(pool):
    with pytest.raises((AttributeError, TypeError, pickle.PicklingError), match="lambda"):
        pool.submit(unsendable).result()
    with pytest.raises(RuntimeError, match="in raise_odd"):
        pool.submit(raise_odd).result()
    with pytest.raises(SweepError, match="top level"):
        pool.submit(len, lambda: None).result()


def test_errors_come_back_with_their_traceback(pool):
    with pytest.raises(ZeroDivisionError) as caught:
        pool.submit(divmod, 7, 0).result()
    assert "Traceback" in caught.value.__notes__[0]


def test_workers_are_other_processes(pool):
    assert pool.submit(os.getpid).result() != os.getpid()


def test_a_killed_worker_costs_one_task_and_is_replaced(pool):
    others = [pool.submit(pow, 2, k) for k in range(20)]
    with pytest.raises(WorkerDiedError, match=r"SIGKILL.*out of memory"):
        pool.submit(signal.raise_signal, signal.SIGKILL).result()
    assert [task.result() for task in others] == [2**k for k in range(20)]
    assert pool.submit(pow, 2, 10).result() == 1024


def test_an_abort_is_reported_by_its_signal_or_status(pool):
    with pytest.raises(WorkerDiedError, match="SIGABRT"):
        pool.submit(os.abort).result()
    with pytest.raises(WorkerDiedError, match="exit status 7"):
        pool.submit(os._exit, 7).result()


def die_in_an_answer():
    pipe = next(found for found in gc.get_objects() if isinstance(found, Connection))
    os.write(pipe.fileno(), struct.pack("!i", 1000) + b"the first of 1000 bytes")
    signal.raise_signal(signal.SIGKILL)


def test_a_worker_killed_while_it_answers_is_a_death_too(pool):
    with pytest.raises(WorkerDiedError, match="SIGKILL"):
        pool.submit(die_in_an_answer).result()


def begin_and_sleep(begun):
    begun.touch()
    time.sleep(2.0 * HANGS)


def test_shutdown_without_waiting_kills_what_runs(tmp_path):
    pool = ProcessPool(1)
    running = pool.submit(begin_and_sleep, tmp_path / "begun")
    waiting = pool.submit(time.sleep, 2.0 * HANGS)
    wait_until((tmp_path / "begun").exists)
    at_once = {"wait": False, "cancel_futures": True}
    shutdown = threading.Thread(target=pool.shutdown, kwargs=at_once, daemon=True)
    shutdown.start()
    wait_until(running.done)
    shutdown.join(HANGS)
    assert waiting.cancelled()
    # The task was killed before its end.
    assert isinstance(running.exception(timeout=0), WorkerDiedError)


@pytest.mark.parametrize("busy", [True, False])
def test_nothing_is_left_when_the_main_process_is_killed(tmp_path, busy):
    script = tmp_path / "main.py"
    script.write_text(
        "import os, sys, time\n"
        "from chaincor.workflows.campaign.pool import ProcessPool\n"
        "if __name__ == '__main__':\n"
        "    pool = ProcessPool(1)\n"
        "    print(pool.submit(os.getpid).result(), flush=True)\n"
        f"    {busy} and pool.submit(time.sleep, {2.0 * HANGS})\n"
        f"    time.sleep({2.0 * HANGS})\n"
    )
    root = Path(__file__).resolve().parents[3]
    with subprocess.Popen(
        [sys.executable, str(script)],
        env=os.environ | {"PYTHONPATH": str(root), "TMPDIR": str(tmp_path)},
        stdout=subprocess.PIPE,
        text=True,
    ) as main:
        worker = int(main.stdout.readline())
        assert list(tmp_path.glob("chaincor-*"))
        main.kill()
    wait_until(lambda: not _runs(worker))
    assert not list(tmp_path.glob("chaincor-*")), "a folder of temporary files was left"


def _runs(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_script_without_a_main_guard_is_reported(tmp_path):
    script = tmp_path / "main.py"
    script.write_text(
        "from chaincor.workflows.campaign.pool import ProcessPool\n"
        "with ProcessPool(1) as pool:\n"
        "    pool.submit(pow, 2, 3).result()\n"
    )
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run(
        [sys.executable, str(script)],
        env=os.environ | {"PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        timeout=HANGS,
        check=False,
    )
    assert done.returncode != 0
    assert "WorkerStartError" in done.stderr
    assert '__name__ == "__main__"' in done.stderr
