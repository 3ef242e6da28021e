"""Run a script along a ladder of values, judge each quantity, and advise a value."""

import shutil
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import positive_number_given, whole_number_given
from chaincor.lammps_inputs.given_texts import path_given, text_given, texts_given
from chaincor.workflows.scripts.crashes import CrashedRun, crashed_runs
from chaincor.workflows.scripts.energy_changes import (
    EnergyChange,
    default_quantities,
    find_energy_changes,
)
from chaincor.workflows.scripts.ladder import Ladder
from chaincor.workflows.scripts.ladder_runs import Progress, ScriptLadder, measure_ladder
from chaincor.workflows.scripts.parting import PartingComparison, compare_runs
from chaincor.workflows.scripts.quantities import RequestedNumbers, read_asked
from chaincor.workflows.scripts.script_run import Runner, ScriptRun, ScriptRunError, list_files
from chaincor.workflows.scripts.script_text import ScriptText
from chaincor.workflows.scripts.step_counts import StepCount
from chaincor.workflows.scripts.study_command import DEFAULT_TIMEOUT, StudyCommand, study_command
from chaincor.workflows.scripts.study_inputs import (
    counts_of_steps,
    lammps_command,
    with_step,
)
from chaincor.workflows.scripts.varied import COMPARED, Varied, read_varied

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class ScriptStudy:
    """
    Result of a study of a script.

    Attributes
    ----------
    script : pathlib.Path
        The script.
    asked : RequestedNumbers
        The requested quantities.
    varied : Varied
        The ladder or comparison, and the script's own step.
    tolerance : float or None
        Requested absolute tolerance.
    ladders : tuple of ScriptLadder
        One ladder for each combination of fixed values.
    comparisons : tuple of PartingComparison
        Comparisons of the first run with runs on other process counts, with another last digit, or
        from a restart.
    crashes : tuple of CrashedRun
        Failed runs, one at each value, with the coarsest value first.
    changes : tuple of EnergyChange
        Energy drifts that no timestep cures.
    counts : tuple of StepCount
        Script commands whose effect depends on the number of steps.
    lmp : str
        Command that starts LAMMPS.
    command : StudyCommand
        Command that would repeat this study.
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
    command: StudyCommand
    kept: Path | None
    seconds: float

    @property
    def ladder(self) -> Ladder | None:
        """First ladder; None if the study compared runs."""
        return self.varied.values

    @property
    def own_step(self) -> float | None:
        """The script's own timestep in its last run; None if the step was not varied."""
        return self.varied.own_step

    @property
    def summary(self) -> str:
        """Bottom line of the study."""
        from chaincor.workflows.scripts.bottom_line import bottom_line

        return bottom_line(self)

    def plot(self) -> "Axes":
        """Draw errors along the ladder, or distances between compared runs, and return the axes."""
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
    Find a time step, or a value of another setting, that is accurate enough for a script.

    The script is run at several time steps from coarse to fine, the rungs of a *ladder*, and at
    several nearby steps for each rung. Each run uses a new copy of the script's folder, so the
    user's files stay unchanged. Every ``run`` command keeps its physical time exactly. Dumps and
    restart files are not written.

    Parameters
    ----------
    script : path
        LAMMPS input.
    quantities : str or sequence of str, optional
        ``KEYWORD`` or ``KEYWORD:KIND``, where the keyword is a thermo keyword, compute or variable.
        The kind is ``mean`` (the default, over the second half of the run), ``last``, ``drift`` or
        ``fluctuation``. If neither `quantities` nor `observable` is given, the study covers
        temperature, potential energy, pressure, and the drift and fluctuation of the total energy.
        With a thermostat, ``econserve`` replaces the total energy if LAMMPS counts the exchanged
        energy; otherwise the drift is left out.
    observable : str, optional
        Regular expression with one group around a number that the script prints. ``^`` and ``$``
        match at the ends of each line, and the last match counts.
    vary : str, optional
        ``NAME=FROM:TO:COUNT``, with the coarse end first and equal ratios between the values. The
        name is a variable of the script, or ``timestep``, ``cutoff``, ``skin`` or ``rows`` if the
        script has no variable of that name. ``lastdigit`` and ``ranks=1,2,4`` compare runs instead.
        By default, the time step is varied from twice the script's own step to a quarter of it.
    fix : sequence of str, optional
        ``NAME=VALUE,VALUE``. The ladder is repeated at each of these values of the variable.
    seeds : int, optional
        Number of runs per rung, each with its own random numbers. If the script has a variable
        ``seed``, the runs differ in this variable, and otherwise in the seeds of the script's
        commands. Results are then judged by their mean over the seeds.
    phases : int, optional
        Number of nearby values per rung, which differ by at most 2 %. Random forces differ between
        nearby steps.
    tolerance : float, optional
        Absolute tolerance of every quantity. For the default of each quantity, see
        :func:`~chaincor.workflows.scripts.tolerances.default_tolerance`.
    scale_periods : bool, optional
        Keep the simulated time of periods that the script counts in steps.
    lmp : str, optional
        Command that starts LAMMPS; by default ``lmp`` in this environment or on the PATH.
    timeout : float, optional
        Largest wall-clock time of one run, in seconds.
    progress : callable, optional
        Function that is called with the name of the current part and the finished fraction of the
        study.

    Returns
    -------
    ScriptStudy
        Verdicts, quantities with their error bars, costs, and advice.

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
    script = path_given("script", script)
    quantities, fix = texts_given("quantities", quantities), texts_given("fix", fix)
    for name, value in {"observable": observable, "vary": vary, "lmp": lmp}.items():
        if value is not None:
            text_given(name, value)
    seeds = None if seeds is None else whole_number_given("seeds", seeds)
    phases = None if phases is None else whole_number_given("phases", phases)
    if tolerance is not None:
        tolerance = positive_number_given("the tolerance", tolerance)
    timeout = positive_number_given("the time limit of a run", timeout)
    text = ScriptText.read(script)
    asked = read_asked(quantities, observable, default_quantities(text))
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
    again = study_command(
        script, quantities, observable=observable, fix=fix, phases=phases,
        # The option --vary seed=N is repeated as --seeds N.
        vary=None if varied.seeds and seeds is None else vary, seeds=len(varied.seeds) or None,
        tolerance=tolerance, scale_periods=scale_periods, lmp=lmp, timeout=timeout,
    )  # fmt: skip
    runner = Runner(text.path, files, asked, command, scratch, timeout, again)
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
        command=again,
        kept=scratch if keep else None,
        seconds=time.perf_counter() - started,
    )
