"""Study a script: run its ladders, judge each quantity, and advise a value."""

import shutil
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.crashes import CrashedRun, crashed_runs
from chaincor.workflows.scripts.energy_changes import EnergyChange, find_energy_changes
from chaincor.workflows.scripts.ladder import Ladder
from chaincor.workflows.scripts.ladder_runs import Progress, ScriptLadder, measure_ladder
from chaincor.workflows.scripts.parting import PartingComparison, compare_runs
from chaincor.workflows.scripts.quantities import RequestedNumbers, read_asked
from chaincor.workflows.scripts.script_run import Runner, ScriptRun, ScriptRunError, list_files
from chaincor.workflows.scripts.script_text import ScriptText
from chaincor.workflows.scripts.step_counts import StepCount
from chaincor.workflows.scripts.study_inputs import (
    counts_of_steps,
    input_words,
    lammps_command,
    with_step,
)
from chaincor.workflows.scripts.varied import COMPARED, Varied, read_varied

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DEFAULT_TIMEOUT = 600.0


@dataclass(frozen=True)
class ScriptStudy:
    """
    Result of a study of a script.

    Attributes
    ----------
    script : pathlib.Path
        The script.
    asked : Asked
        The requested quantities.
    varied : Varied
        The ladder or comparison, and the script's own step.
    tolerance : float or None
        Requested error.
    ladders : tuple of ScriptLadder
        One for each combination of fixed values.
    comparisons : tuple of Comparison
        Comparisons of the first run with runs on other processes, with another last digit,
        or from a restart.
    crashes : tuple of CrashedRun
        Runs that failed, one for each value, the coarsest first.
    changes : tuple of EnergyChange
        Changes of energy that no step cures.
    counts : tuple of StepCount
        Commands of the script that count steps.
    lmp : str
        The command of LAMMPS.
    command : tuple of str
        Words of the command of this study, without the ladder.
    kept : pathlib.Path or None
        Folder of the failed runs.
    seconds : float
        Wall-clock time of the study.
    """

    script: Path
    asked: RequestedNumbers
    varied: Varied
    tolerance: float | None
    ladders: tuple[ScriptLadder, ...]
    comparisons: tuple[PartingComparison, ...]
    crashes: tuple[CrashedRun, ...]
    changes: tuple[EnergyChange, ...]
    counts: tuple[StepCount, ...]
    lmp: str
    command: tuple[str, ...]
    kept: Path | None
    seconds: float

    @property
    def ladder(self) -> Ladder | None:
        """First ladder; None if runs were compared."""
        return self.varied.values

    @property
    def own_step(self) -> float | None:
        """Script's own step in its last run, if the step was varied."""
        return self.varied.own_step

    @property
    def summary(self) -> str:
        """Bottom line of the study."""
        from chaincor.workflows.scripts.bottom_line import bottom_line

        return bottom_line(self)

    def plot(self) -> "Axes":
        """Draw errors along the ladder, or the distance of compared runs, and return the axes."""
        from chaincor.workflows.scripts.figure import plot_script_study

        return plot_script_study(self)

    def __repr__(self) -> str:
        """Return the script, the quantities and the bottom line."""
        names = ", ".join(self.asked.names)
        return f"<ScriptStudy of {self.script.name}: {names}. {self.summary}>"

    def _repr_html_(self) -> str:
        from chaincor.workflows.scripts.description import study_to_html

        return study_to_html(self)


def timestep_study(
    script: Path | str,
    quantities: Sequence[str] = (),
    *,
    observable: str | None = None,
    vary: str | None = None,
    fix: Sequence[str] = (),
    seeds: int | None = None,
    phases: int | None = None,
    tolerance: float | None = None,
    scale_periods: bool = False,
    lmp: str | None = None,
    timeout: float = DEFAULT_TIMEOUT,
    progress: Progress = lambda _part, _done: None,
) -> ScriptStudy:
    """
    Find the time step, or a value of another setting, that is accurate enough for a script.

    The script runs at each step of a ladder and at several nearby steps, each time in a new copy of
    its folder, so that the user's files stay unchanged. Every ``run`` keeps its physical time
    exactly. Dumps and restarts are left out.

    Parameters
    ----------
    script : path
        LAMMPS input.
    quantities : sequence of str, optional
        ``KEYWORD`` or ``KEYWORD:KIND``, where the keyword is a thermo keyword, compute or variable.
        The kind is ``mean`` (over the second half of the run, the default), ``last``, ``drift`` or
        ``fluctuation``. Without quantities and an `observable`, the study covers drift and
        fluctuation of the total energy, temperature, potential energy and pressure.
    observable : str, optional
        Regular expression with one group around a number that the script prints. ``^`` and ``$``
        match at each line, and the last match counts.
    vary : str, optional
        ``NAME=FROM:TO:COUNT``, with the coarse end first and equal ratios between the values. The
        name is a variable of the script, or ``timestep``, ``cutoff``, ``skin`` or ``rows`` if the
        script has no variable of that name. ``lastdigit`` and ``ranks=1,2,4`` compare runs instead.
        By default, the study varies the script's step from twice to a quarter of it.
    fix : sequence of str, optional
        ``NAME=VALUE,VALUE``. The ladder is repeated at each of these values of another variable.
    seeds : int, optional
        Number of runs per rung, each with its own random numbers. The runs differ in the variable
        ``seed``, or otherwise in the seeds in the script. The reference is then the mean over
        seeds.
    phases : int, optional
        Number of nearby values per rung, within 2 %. Nearby steps have different random forces.
    tolerance : float, optional
        Absolute tolerance of every quantity. The default depends on the quantity, see
        :func:`~chaincor.workflows.scripts.tolerances.default_tolerance`.
    scale_periods : bool, optional
        Keep the simulated time of periods that the script counts in steps.
    lmp : str, optional
        Command of LAMMPS; by default from this environment or otherwise from the PATH.
    timeout : float, optional
        Largest wall-clock time of one run, in seconds.
    progress : callable, optional
        Function that is called with the name of the current part and the finished fraction.

    Returns
    -------
    ScriptStudy
        Verdicts, values with their error bars, costs, and the advice.

    Raises
    ------
    InputError
        If an option is invalid, or if the script does not use a given variable.
    ScriptRunError
        If the finest run fails, or if fewer than four rungs run.

    Examples
    --------
    >>> from chaincor import Scene, timestep_study, write_job
    >>> scene = Scene(potential="harmonic", particles=5, scheme="verlet", timestep=0.1)
    >>> files = write_job(scene, "job", plain=True)
    >>> study = timestep_study("job/in.chain", observable="^restitution = (.*)$", phases=3)
    >>> study.ladders[0].numbers[0].verdict.kind
    'bounded'
    >>> study.summary.split(". ")[0]
    'Your timestep 0.1 cannot be judged yet'
    """
    started = time.perf_counter()
    asked = read_asked(quantities, observable)
    if tolerance is not None and not 0.0 < tolerance < np.inf:
        raise InputError(f"the tolerance is {tolerance}. Give a positive number")
    if not 0.0 < timeout < np.inf:
        raise InputError(f"--timeout is {timeout}. Give a positive number of seconds")
    text = ScriptText.read(Path(script))
    text.check()
    printed = observable is not None
    varied = read_varied(
        text, vary, fix, seeds, phases, printed=printed, scale_periods=scale_periods
    )
    compared = varied.kind in COMPARED
    options = {"--fix": fix, "--seeds": seeds, "--phases": phases, "--tolerance": tolerance}
    unused = [
        name for name, value in (options | {"--scale-periods": scale_periods}).items() if value
    ]
    if compared and unused:
        raise InputError(
            f"--vary {varied.switch[0]} compares runs at the script's own step and "
            f"does not use {', '.join(unused)}. Leave out one or the other"
        )
    command = lammps_command(lmp)
    files = list_files(text.path.resolve().parent)
    scratch = Path(tempfile.mkdtemp(prefix="chaincor-script-")).resolve()
    words = input_words(script, quantities, observable, fix, tolerance, scale_periods, lmp)
    runner = Runner(text.path, files, asked, command, scratch, timeout, words)
    keep = False
    comparisons: tuple[PartingComparison, ...] = ()
    changes: tuple[EnergyChange, ...] = ()
    found: list[ScriptLadder] = []
    failed: list[tuple[float, ScriptRun]] = []
    try:
        if compared:
            comparisons = compare_runs(runner, varied)
        else:
            varied, failed = with_step(runner, varied)
            for values in varied.fixed:

                def part(name: str, done: float) -> None:
                    progress(name, (len(found) + done) / len(varied.fixed))

                found.append(measure_ladder(runner, varied, values, tolerance, part))
            changes = find_energy_changes(runner, varied, found[0])
        failed += [each for ladder in found for each in ladder.failed]
        keep = bool(failed)
    except ScriptRunError:
        keep = True
        raise
    finally:
        if not keep:
            shutil.rmtree(scratch, ignore_errors=True)
    return ScriptStudy(
        script=text.path,
        asked=asked,
        varied=varied,
        tolerance=tolerance,
        ladders=tuple(found),
        comparisons=comparisons,
        crashes=crashed_runs(failed, varied.own_step, "" if compared else varied.ladder.name),
        changes=changes,
        counts=counts_of_steps(varied),
        lmp=command,
        command=words,
        kept=scratch if keep else None,
        seconds=time.perf_counter() - started,
    )
