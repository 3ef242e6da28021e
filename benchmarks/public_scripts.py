"""What `timestep_study` says of public inputs, edited in size alone, and if its bounds hold."""

import argparse
import math
import re
import shutil
import tempfile
import time
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.scripts.quantities import ALL, read_quantity
from chaincor.workflows.scripts.rewriting import Change
from chaincor.workflows.scripts.script_run import Asked, ScriptRun, list_files, run_script
from chaincor.workflows.scripts.study import ScriptStudy, timestep_study

ASKED = Asked(None, tuple(read_quantity(text) for text in ALL))
# Seconds of the wall clock that one run may take.
LONGEST_RUN = 120.0
LEAST_STEPS = 200
TRUTHS = 2
# Half and third steps of nearby values that were not tried.
FRESH = 0.991
RUN = re.compile(r"^(\s*run\s+)(\d+)", re.MULTILINE)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("root", type=Path, help="folder that the names are in")
    parser.add_argument("names", nargs="+", help="input files below it")
    parser.add_argument(
        "--seconds", type=float, default=0.6, help="processor time of a script; longer ones are cut"
    )
    options = parser.parse_args()
    print(
        "| input | runs / | answered | cannot tell | advised step / its own | bounds kept | time |"
    )
    print("|---" * 7 + "|")
    for name in options.names:
        print(row(options.root, name, options.seconds), flush=True)


def row(root: Path, name: str, seconds: float) -> str:
    """Study one input in a copy of its folder, follow the advice, and say what became of it."""
    folder = Path(tempfile.mkdtemp(prefix="public-"))
    started = time.perf_counter()
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
        taken = time.perf_counter() - started
        return f"| {name} | {fewer} | {told(study)} | {followed(study)} | {taken:.0f} s |"
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def run(script: Path, finer: float) -> ScriptRun:
    """Run a script at a step so many times finer."""
    scratch = Path(tempfile.mkdtemp(prefix="public-run-")).resolve()
    try:
        return run_script(
            script,
            list_files(script.parent),
            ASKED,
            Change(finer=finer, quantities=ASKED.sampled),
            name="run",
            lmp=find_lmp_command() or "lmp",
            scratch=scratch,
            timeout=LONGEST_RUN * max(finer, 1.0),
        )
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
    """Run the script as advised, and four times finer than the ladder; count bounds that hold."""
    assert study.ladder is not None
    assert study.own_step is not None
    numbers = [each for each in study.ladders[0].numbers if each.advice is not None]
    finest = study.own_step / study.ladder.fine
    judges = [run(study.script, 4.0 * finest * FRESH**k) for k in range(TRUTHS)]
    judges = [each for each in judges if not each.failure]
    runs: dict[float, ScriptRun] = {}
    kept, judged = 0, 0
    for each in numbers:
        assert each.advice is not None
        if each.advice.promised_error is None or len(judges) < TRUTHS:
            continue
        step = each.advice.value * FRESH
        if step not in runs:
            runs[step] = run(study.script, study.own_step / step)
        if runs[step].failure:
            judged += 1
            continue
        truths = [judge.numbers[each.name].value for judge in judges]
        # The truth is uncertain by the scatter of a few runs.
        scatter = max(float(np.std(truths, ddof=1)), float(each.verdict.scatter[-1]))
        bar = 2.0 * scatter / math.sqrt(len(truths))
        off = abs(runs[step].numbers[each.name].value - float(np.mean(truths)))
        kept += off <= each.advice.promised_error + bar
        judged += 1
    return f"{kept} of {judged}"


if __name__ == "__main__":
    main()
