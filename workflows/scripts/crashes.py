"""Read from LAMMPS's output at which step and why a run stopped."""

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from chaincor.workflows.scripts.script_run import ScriptRun

_SOURCE = re.compile(r"\s*\((?:\S*/)?\w+\.(?:cpp|h):\d+\)")
_ERROR = re.compile(r"^ERROR(?: on proc \d+)?:\s*(.*)$", re.MULTILINE)
# In these error messages, LAMMPS names the step and the atoms.
_WHERE = (
    (re.compile(r"FENE bond too long: (\d+) (\d+) (\d+) (\S+)"), "bond of atoms {} and {}"),
    (
        re.compile(r"[Bb]ond atoms? (\d+) (\d+) missing on proc \d+ at step (\d+)"),
        "atoms {} and {}",
    ),
    (
        re.compile(r"Angle atoms? (\d+) (\d+) (\d+) missing on proc \d+ at step (\d+)"),
        "atoms {}, {} and {}",
    ),
    (re.compile(r"atoms? ((?:\d+ ){2,}\d+ ?)missing on proc \d+ at step (\d+)"), "atoms {}"),
)
# These commands run no step, so a smaller step would not cure their errors.
_WITHOUT_STEPS = frozenset({
    "print", "variable", "fix", "fix_modify", "unfix", "compute", "uncompute", "thermo_style",
    "thermo_modify", "dump", "write_data", "write_dump", "write_restart", "read_data",
    "read_restart", "pair_style", "pair_coeff", "bond_style", "bond_coeff", "group", "velocity",
})  # fmt: skip
_LAST = re.compile(r"^Last (?:input line|command): (\S+)", re.MULTILINE)
_AT_STEP = re.compile(r"(?:at|on) (?:time)?step (\d+)")


@dataclass(frozen=True)
class Crash:
    """A run that LAMMPS ended with an error."""

    step: int | None  #: Step of the run; None if unknown.
    exact: bool  #: Whether LAMMPS names the step; otherwise it is the last sampled step.
    message: str  #: The error, and the atoms that LAMMPS names first.

    def __str__(self) -> str:
        where = "" if self.step is None else f" {'at' if self.exact else 'after'} step {self.step}"
        return f"the run stops{where}: {self.message}"


def find_crash(screen: str, sampled: int | None, failure: str) -> Crash:
    """
    Find the step and the reason of a crash in LAMMPS's output.

    `sampled` is the last sampled step, and is used if the output names no step. `failure` is the
    message to use if LAMMPS printed no error. The step is None if the failed command runs no steps.
    """
    errors = _ERROR.findall(screen)
    message = _SOURCE.sub("", errors[-1]).strip() if errors else failure
    step, blamed = None, ""
    for pattern, said in _WHERE:
        if (found := pattern.search(screen)) is not None:
            groups = found.groups()
            if "FENE" in pattern.pattern:
                step, atoms, message = int(groups[0]), groups[1:3], "FENE bond too long"
            else:
                step, atoms = int(groups[-1]), groups[:-1]
            blamed = said.format(*(each.strip() for each in atoms))
            break
    if step is None and (named := _AT_STEP.search(message)) is not None:
        step = int(named[1])
    last = _LAST.findall(screen)
    if step is None and last and last[-1] in _WITHOUT_STEPS:
        return Crash(None, False, message)
    if blamed and not all(word in message for word in re.findall(r"\d+", blamed)):
        message += f" ({blamed})"
    return Crash(sampled if step is None else step, step is not None, message)


@dataclass(frozen=True)
class CrashedRun:
    """A run of a study that failed."""

    name: str  #: Name of the varied setting.
    value: float  #: Value of the varied setting.
    timestep: float | None  #: Time step of the run; None if unknown.
    step: int | None  #: Step at which the run stopped, or the last sampled step; None if unknown.
    said: str  #: Description of the crash, as a clause.
    message: str  #: LAMMPS's error.

    def __str__(self) -> str:
        return f"At {self.name} {self.value:g} {self.said}."


def crashed_runs(
    failed: list[tuple[float, "ScriptRun"]], own_step: float | None, name: str
) -> tuple[CrashedRun, ...]:
    """Return the failed runs, one at each value of the setting, with the coarsest value first."""
    found: dict[float, CrashedRun] = {}
    for value, run in failed:
        timestep = run.step if own_step is None else value
        failure = str(run.failure)
        said = str(run.crash) if run.crash else failure.removesuffix(".")
        message = run.crash.message if run.crash else failure
        step = run.crash.step if run.crash else None
        found.setdefault(value, CrashedRun(name, value, timestep, step, said, message))
    return tuple(sorted(found.values(), key=lambda each: -each.value))
