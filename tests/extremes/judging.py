"""Call the command line with a case, and check its output."""

import contextlib
import io
import json
import os
import re
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from chaincor.workflows import cli
from tests.extremes.cases import Case
from tests.waiting import HANGS, HangError, must_end

# No input may take more than this processor time.
HANG_SECONDS = 10.0
_STATUSES = (0, 1, 2)
_NOT_A_NUMBER = re.compile(r"(?<![\w./-])(nan|inf|infinity)(?![\w./])", re.IGNORECASE)


@dataclass(frozen=True)
class Answer:
    """Result of a call: status, output, seconds (processor time if in this process), files left."""

    status: int | None
    stdout: str
    stderr: str
    seconds: float
    stray: tuple[str, ...]
    spoiled: bool


def call_in_process(case: Case, hang_seconds: float = HANG_SECONDS) -> Answer:
    """Call the command line in this process, in a folder of its own."""
    with _prepared(case) as (folder, temporary):
        out, err = io.StringIO(), io.StringIO()
        status: int | None = None
        started = time.process_time()
        before, kept = Path.cwd(), tempfile.tempdir
        os.chdir(folder)
        tempfile.tempdir = str(temporary)
        try:
            with (
                contextlib.redirect_stdout(out),
                contextlib.redirect_stderr(err),
                warnings.catch_warnings(),
                must_end(hang_seconds),
            ):
                warnings.simplefilter("always")
                status = cli.run_command_line(list(case.arguments))
        except HangError:
            err.write(f"HANG: {traceback.format_exc(limit=-4)}".replace("Traceback", "at"))
        except SystemExit as leave:
            err.write(f"SystemExit({leave.code})")
        except BaseException:
            err.write(traceback.format_exc())
        finally:
            os.chdir(before)
            tempfile.tempdir = kept
        seconds = time.process_time() - started
        stray, spoiled = _left_behind(case, folder, temporary, status)
        return Answer(status, out.getvalue(), err.getvalue(), seconds, stray, spoiled)


def call_as_process(case: Case, hang_seconds: float = HANGS) -> Answer:
    """Call the command line as users do: in a process of its own."""
    with _prepared(case) as (folder, temporary):
        started = time.perf_counter()
        code = "from chaincor.workflows.cli import main; main()"
        environment = os.environ | {"TMPDIR": str(temporary)}
        environment["PYTHONPATH"] = str(Path(__file__).parents[2])
        status: int | None = None
        try:
            done = subprocess.run(
                [sys.executable, "-c", code, *case.arguments],
                cwd=folder,
                env=environment,
                capture_output=True,
                timeout=hang_seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            out, err = "", "HANG"
        else:
            status = done.returncode
            out, err = (text.decode(errors="replace") for text in (done.stdout, done.stderr))
        seconds = time.perf_counter() - started
        stray, spoiled = _left_behind(case, folder, temporary, status)
        return Answer(status, out, err, seconds, stray, spoiled)


_MISTAKES = re.compile(r"\b(\d+) mistakes \(see: chaincor explain SceneError\):$")


def faults(case: Case, answer: Answer) -> list[str]:
    """Return a list of faults in an answer, empty for a good answer."""
    found = []
    lines = [line for line in answer.stderr.splitlines() if line.strip()]
    if "Traceback" in answer.stderr or "HANG" in answer.stderr or answer.status is None:
        return [f"no clean exit: {answer.stderr[-1500:]}"]
    if answer.status not in _STATUSES:
        found.append(f"exit status {answer.status}")
    if answer.status == 0:
        # A run that takes more than a minute, as on a busy machine, prints a message.
        fine = ("chaincor: note: ", "chaincor: running, longer than")
        lines = [line for line in lines if not line.startswith(fine)]
    if answer.status == 0 and lines:
        found.append(f"noise on success: {lines[0][:300]}")
    if answer.status == 2 and lines and (reported := _MISTAKES.search(lines[0])):
        # Several mistakes in one scene give one line each.
        mistakes = [line for line in lines[1:] if line.startswith("  ") and len(line) < 1000]
        if len(mistakes) == int(reported[1]) == len(lines) - 1:
            lines = lines[:1]
    if answer.status == 2 and (len(lines) != 1 or answer.stdout.strip()):
        found.append(f"not one line: {answer.stderr[:500]!r} {answer.stdout[:100]!r}")
    if answer.status == 1 and (len(lines) > 1 or not (lines or answer.stdout.strip())):
        found.append(f"not one line: {answer.stderr[:500]!r}")
    if lines and not lines[0].startswith("chaincor: "):
        found.append(f"unnamed: {lines[0][:300]}")
    if answer.status in (1, 2) and lines and len(lines[0]) > 1000:
        found.append(f"an endless line: {lines[0][:200]}...")
    if case.arguments[:1] in (("run",), ("analyze",)) and _NOT_A_NUMBER.search(answer.stdout):
        found.append(f"not a number printed: {answer.stdout[:300]}")
    if answer.status == 0 and "--json" in case.arguments:
        try:
            json.loads(answer.stdout, parse_constant=_refuse)
        except ValueError as error:
            found.append(f"not JSON ({error}): {answer.stdout[:200]}")
    if answer.stray:
        found.append(f"stray files: {', '.join(answer.stray[:5])}")
    if answer.spoiled:
        found.append("a failure took the place of a good file")
    return found


def _refuse(constant: str) -> float:
    raise ValueError(constant)


@contextlib.contextmanager
def _prepared(case: Case) -> Iterator[tuple[Path, Path]]:
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        folder, temporary = Path(name) / "here", Path(name) / "tmp"
        folder.mkdir()
        temporary.mkdir()
        for relative, data in case.files.items():
            path = folder / relative
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        yield folder, temporary


def _left_behind(
    case: Case, folder: Path, temporary: Path, status: int | None
) -> tuple[tuple[str, ...], bool]:
    allowed = [folder / name for name in case.outputs if "\x00" not in name]
    stray = []
    for path in folder.parent.rglob("*"):
        known = path in (folder, temporary) or str(path.relative_to(folder.parent)) == "here/taken"
        wanted = any(
            path == good or good in path.parents or path in good.parents for good in allowed
        )
        given = path.is_dir() or path.name in {Path(name).name for name in case.files}
        if known or given or (wanted and path.name[0] != "."):
            continue
        stray.append(str(path.relative_to(folder.parent)))
    taken = folder / "taken"
    spoiled = status in (1, 2) and "taken" in case.files and not _is_good(taken)
    read = [name for name in case.files if not _may_change(name, case)]
    spoiled = spoiled or any(not _is_kept(folder / name, case.files[name]) for name in read)
    return tuple(stray), spoiled


def _may_change(name: str, case: Case) -> bool:
    """Return whether a file is named as an output, or lies in a folder that is."""
    return any(out == name or name.startswith(f"{out}/") for out in (*case.outputs, "taken"))


def _is_kept(path: Path, content: bytes) -> bool:
    return path.is_file() and path.read_bytes() == content


def _is_good(taken: Path) -> bool:
    return taken.is_file() and taken.read_bytes() == b"good"
