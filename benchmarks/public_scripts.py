"""Test the advice of `chaincor timestep` on public inputs, with runs at finer time steps."""

import argparse
import math
import os
import pickle
import re
import shutil
import signal
import sys
import tempfile
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.scripts.bottom_line import answer_of
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.description import describe_script_study
from chaincor.workflows.scripts.quantities import ALL, RequestedNumbers, read_quantity
from chaincor.workflows.scripts.script_run import Runner, ScriptRun, list_files
from chaincor.workflows.scripts.study import ScriptStudy, timestep_study

ASKED = RequestedNumbers(None, tuple(read_quantity(text) for text in ALL))
# Longest run, in seconds of elapsed time.
LONGEST_RUN = 400.0
LEAST_STEPS = 200
TRUTHS = 2
# Factor of a time step, which makes it a step that the study has not used.
FRESH = 0.991
# First seeds, which the study does not use.
JUDGES, FOLLOWERS = 1_000, 2_000
RUN = re.compile(r"^(\s*run\s+)(\d+)", re.MULTILINE)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("root", type=Path, help="folder that the names are in")
    parser.add_argument("names", nargs="+", help="input files below it")
    parser.add_argument(
        "--seconds", type=float, default=0.6, help="processor time of a script; longer ones are cut"
    )
    parser.add_argument("--output", type=Path, help="folder for each study: its text, and pickled")
    parser.add_argument(
        "--limit", type=int, default=0, help="seconds of the wall clock for one input; 0 for none"
    )
    options = parser.parse_args()
    signal.signal(signal.SIGALRM, _stop)
    heads = ("input", "lengths /", "bottom line", "kept", "processor time")
    print(f"| {' | '.join(heads)} |")
    print("|---" * len(heads) + "|")
    for name in options.names:
        signal.alarm(options.limit)
        print(row(options.root, name, options.seconds, options.output), flush=True)
        signal.alarm(0)


def _stop(_signal: int, _frame: object) -> None:
    raise TimeoutError


def row(root: Path, name: str, seconds: float, output: Path | None) -> str:
    """Study one input in a copy of its folder, follow the advice, and return the outcome."""
    folder = Path(tempfile.mkdtemp(prefix="public-"))
    started = worked()
    try:
        source = root / name
        for path in source.parent.iterdir():
            if path.is_file() and path.stat().st_size < 20_000_000:
                shutil.copyfile(path, folder / path.name)
        script = folder / source.name
        try:
            fewer = made_small(script, seconds)
            study = timestep_study(script, timeout=LONGEST_RUN)
        except ChaincorError as error:
            return f"| {name} | - | refused: {error} | - | - |"
        except TimeoutError:
            return f"| {name} | - | the study did not end in time | - | - |"
        taken = worked() - started
        if output is not None:
            output.mkdir(parents=True, exist_ok=True)
            text = describe_script_study(study)
            (output / f"{name.replace('/', '_')}.txt").write_text(text + "\n", encoding="utf-8")
            (output / f"{name.replace('/', '_')}.pickle").write_bytes(pickle.dumps(study))
        try:
            kept = followed(study)
        except TimeoutError:
            kept = "not judged in time"
        return f"| {name} | {fewer} | {study.summary} | {kept} | {taken:.0f} s |"
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def worked() -> float:
    """Return the processor time of this process and its child processes so far, in seconds."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def run(script: Path, finer: float, seed: int = 0) -> ScriptRun:
    """Run a script at a finer time step, with another seed of its random forces."""
    scratch = Path(tempfile.mkdtemp(prefix="public-run-")).resolve()
    command, timeout = find_lmp_command() or "lmp", LONGEST_RUN * max(finer, 1.0)
    runner = Runner(script, list_files(script.parent), ASKED, command, scratch, timeout)
    try:
        return runner.run("run", Change(finer=finer, seed=seed, forces_alone=True))
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def made_small(script: Path, seconds: float) -> int:
    """Divide the lengths of all runs to make the script quick; return the divisor."""
    text = script.read_text("utf-8", "replace")
    longest = max((int(steps) for _, steps in RUN.findall(text)), default=0)

    def shorten(fewer: int) -> None:
        script.write_text(
            RUN.sub(lambda found: f"{found[1]}{max(int(found[2]) // fewer, 1)}", text), "utf-8"
        )

    fewer = max(longest // LEAST_STEPS, 1)
    shorten(fewer)
    # A shortened start may leave particles too close to each other, or a mean without a value.
    while (done := run(script, 1.0)).failure and fewer > 1:
        script.write_text(text, "utf-8")
        fewer //= 2
        shorten(fewer)
    longest_cut = fewer
    taken = done.seconds
    # Runs are lengthened as far as the time allows, to a power of two below the original length.
    fewer = 2 ** math.ceil(math.log2(max(fewer * taken / seconds, 1.0)))
    fewer = min(fewer, longest_cut)
    shorten(fewer)
    return fewer


def followed(study: ScriptStudy) -> str:
    """Follow the advice, and count the quantities that are within their tolerance."""
    assert study.ladder is not None
    assert study.own_step is not None
    (ladder,) = study.ladders
    numbers = [each.number for each in answer_of(study, ladder).judged]
    step, count = promise(study)
    if step is None:
        return "no step"
    finest = study.own_step / float(ladder.values[-1])
    judges = [run(study.script, 4.0 * finest * FRESH**k, JUDGES + k) for k in range(TRUTHS)]
    judges = [each for each in judges if not each.failure]
    if len(judges) < TRUTHS:
        return "not judged"
    steps = [step * (FRESH - 0.001 * k) for k in range(count)]
    runs = [run(study.script, study.own_step / h, FOLLOWERS + k) for k, h in enumerate(steps)]
    runs = [each for each in runs if not each.failure]
    missed = []
    for each in numbers:
        truths = [judge.numbers[each.name].value for judge in judges]
        # The scatter of a few runs gives the uncertainty of the reference.
        scatter = max(float(np.std(truths, ddof=1)), float(each.verdict.scatter[-1]))
        bar = 2.0 * scatter / math.sqrt(len(truths))
        found = [each_run.numbers[each.name].value for each_run in runs]
        off = abs(float(np.mean(found)) - float(np.mean(truths))) if found else math.inf
        assert each.tolerance is not None
        if off > each.tolerance + bar:
            missed.append(f"{each.name} by {off:.2g}, {each.tolerance:.2g} promised")
    print("\n".join(missed), file=sys.stderr, flush=True)
    return f"{len(numbers) - len(missed)} of {len(numbers)}"


def promise(study: ScriptStudy) -> tuple[float | None, int]:
    """Return the time step of the advice, and the number of runs to average."""
    use = answer_of(study, study.ladders[0]).use
    return (None, 0) if use is None else (use.value, use.runs)


if __name__ == "__main__":
    main()
