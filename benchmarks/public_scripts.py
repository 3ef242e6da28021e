"""What `timestep_study` says of public inputs, edited in size alone, and if its bounds hold."""

import argparse
import math
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.quantities import ALL, Asked, read_quantity
from chaincor.workflows.scripts.script_run import Runner, ScriptRun, list_files
from chaincor.workflows.scripts.study import ScriptStudy, timestep_study

ASKED = Asked(None, tuple(read_quantity(text) for text in ALL))
# Seconds of the wall clock that one run may take.
LONGEST_RUN = 400.0
LEAST_STEPS = 200
TRUTHS = 2
# Nearby values that were not tried.
FRESH = 0.991
# Seeds, beside those of the study.
JUDGES, FOLLOWERS = 1_000, 2_000
RUN = re.compile(r"^(\s*run\s+)(\d+)", re.MULTILINE)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("root", type=Path, help="folder that the names are in")
    parser.add_argument("names", nargs="+", help="input files below it")
    parser.add_argument(
        "--seconds", type=float, default=0.6, help="processor time of a script; longer ones are cut"
    )
    options = parser.parse_args()
    heads = ("input", "lengths /", "numbers answered", "cannot tell", "advised step / its own")
    print(f"| {' | '.join((*heads, 'bounds kept', 'processor time'))} |")
    print("|---" * 7 + "|")
    for name in options.names:
        print(row(options.root, name, options.seconds), flush=True)


def row(root: Path, name: str, seconds: float) -> str:
    """Study one input in a copy of its folder, follow the advice, and say what became of it."""
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
            said = re.sub(r"; expected .*", "", str(error))
            return f"| {name} | - | refused: {said[:160]} | - | - | - | - |"
        taken = worked() - started
        return f"| {name} | {fewer} | {told(study)} | {followed(study)} | {taken:.0f} s |"
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def worked() -> float:
    """Return processor seconds spent so far, by this process and by all that it started."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def run(script: Path, finer: float, seed: int = 0) -> ScriptRun:
    """Run a script at a step so many times finer, its random forces with numbers of their own."""
    scratch = Path(tempfile.mkdtemp(prefix="public-run-")).resolve()
    command, timeout = find_lmp_command() or "lmp", LONGEST_RUN * max(finer, 1.0)
    runner = Runner(script, list_files(script.parent), ASKED, command, scratch, timeout)
    try:
        return runner.run("run", Change(finer=finer, seed=seed, forces_alone=True))
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def made_small(script: Path, seconds: float) -> int:
    """Divide the lengths of all runs so that the script is quick; returns by how much."""
    text = script.read_text("utf-8", "replace")
    longest = max((int(steps) for _, steps in RUN.findall(text)), default=0)

    def shorten(fewer: int) -> None:
        script.write_text(
            RUN.sub(lambda found: f"{found[1]}{max(int(found[2]) // fewer, 1)}", text), "utf-8"
        )

    fewer = max(longest // LEAST_STEPS, 1)
    shorten(fewer)
    done = run(script, 1.0)
    if done.failure:
        # A shortened start may leave particles too close to each other.
        script.write_text(text, "utf-8")
        return 1
    taken = done.seconds
    # So many steps more as there is time for, their number a power of two below the script's.
    fewer = 2 ** math.ceil(math.log2(max(fewer * taken / seconds, 1.0)))
    fewer = min(fewer, max(longest // LEAST_STEPS, 1))
    shorten(fewer)
    return fewer


def told(study: ScriptStudy) -> str:
    """Say of how many numbers there is an advice, and of how many nothing can be told."""
    numbers = study.ladders[0].numbers
    untold = [each.name for each in numbers if each.verdict.kind == "cannot tell"]
    answered = sum(each.advice is not None for each in numbers)
    assert study.own_step is not None
    steps = [each.advice.value / study.own_step for each in numbers if each.advice is not None]
    span = f"{min(steps):.2g} to {max(steps):.2g}" if steps else "-"
    return f"{answered} of {len(numbers)} | {', '.join(untold) or '-'} | {span}"


def followed(study: ScriptStudy) -> str:
    """Do as advised, and run four times finer than the ladder; count bounds that hold."""
    assert study.ladder is not None
    assert study.own_step is not None
    numbers = [each for each in study.ladders[0].numbers if each.advice is not None]
    finest = study.own_step / study.ladder.fine
    judges = [run(study.script, 4.0 * finest * FRESH**k, JUDGES + k) for k in range(TRUTHS)]
    judges = [each for each in judges if not each.failure]
    runs: dict[tuple[float, int], ScriptRun] = {}
    kept, judged, missed = 0, 0, []
    for each in numbers:
        assert each.advice is not None
        if each.advice.promised_error is None or len(judges) < TRUTHS:
            continue
        judged += 1
        found = []
        for k in range(each.advice.runs):
            step = each.advice.value * (FRESH - 0.001 * k)
            if (step, k) not in runs:
                runs[step, k] = run(study.script, study.own_step / step, FOLLOWERS + k)
            if not runs[step, k].failure:
                found.append(runs[step, k].numbers[each.name].value)
        truths = [judge.numbers[each.name].value for judge in judges]
        # The truth is uncertain by the scatter of a few runs.
        scatter = max(float(np.std(truths, ddof=1)), float(each.verdict.scatter[-1]))
        bar = 2.0 * scatter / math.sqrt(len(truths))
        off = abs(float(np.mean(found)) - float(np.mean(truths))) if found else math.inf
        if off <= each.advice.promised_error + bar:
            kept += 1
        else:
            missed.append(f"{each.name} by {off:.2g}, {each.advice.promised_error:.2g} promised")
    print("\n".join(missed), file=sys.stderr, flush=True)
    return f"{kept} of {judged}"


if __name__ == "__main__":
    main()
