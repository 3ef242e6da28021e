"""Define options and settings that all tests share."""

import faulthandler
import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Generator, Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from tests.waiting import HANGS

# If a shell starts the suite in the background, the suite ignores Ctrl-C. Processes that a test
# starts and interrupts would ignore Ctrl-C, too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Without a deadline, the load of the machine does not decide whether a property holds.
settings.register_profile("chaincor", deadline=None, max_examples=60, derandomize=True)
settings.load_profile("chaincor")

# Only a test that hangs takes this long, including set-up and clean-up.
TEST_HANGS, END_HANGS = 3.0 * HANGS, HANGS
_STDERR = pytest.StashKey[int]()


def pytest_configure(config: pytest.Config) -> None:
    # This copy of file descriptor 2 still shows output while pytest captures the original.
    config.stash[_STDERR] = os.dup(2)


def _end_after(seconds: float, config: pytest.Config) -> None:
    """End this process after some seconds, with a traceback of each of its threads."""
    faulthandler.dump_traceback_later(seconds, exit=True, file=config.stash[_STDERR])


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """End a worker of pytest-xdist that hangs in a test or waits for the next one for too long."""
    _end_after(TEST_HANGS, item.config)
    try:
        return (yield)
    finally:
        _end_after(END_HANGS, item.config)


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """End workers and the controller even if a thread, child or exit handler hangs."""
    _end_after(END_HANGS, session.config)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write the golden files under tests/golden anew instead of comparing with them",
    )


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark as slow all but the first case of tests whose cases take about a second each."""
    seen = set()
    for item in items:
        if item.get_closest_marker("slow_cases"):
            family = item.nodeid.partition("[")[0]
            if family in seen:
                item.add_marker("slow")
            seen.add(family)


@pytest.fixture
def update_golden(request: pytest.FixtureRequest) -> bool:
    return request.config.getoption("--update-golden")


@pytest.fixture
def chaincor(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Return a function that runs a command and returns exit status, stdout and stderr."""
    from chaincor.workflows.cli import main

    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as left:
            main([str(argument) for argument in arguments])
        said = capsys.readouterr()
        assert "Traceback" not in said.err
        return left.value.code, said.out, said.err

    return run


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Return the folder of a file system of 300 kB, which only the administrator can make."""
    folder = tmp_path / "small"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", str(folder)]
    if shutil.which("mount") is None or os.geteuid() != 0:
        pytest.skip("needs the right to mount a small file system")
    if subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("no small file system can be mounted here")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)
