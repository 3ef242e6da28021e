"""Test the advice of `chaincor timestep` for six scripts, by following it."""

import argparse
import math
import shutil
import tempfile
from pathlib import Path

import numpy as np

from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.quantities import RequestedNumbers
from chaincor.workflows.scripts.script_run import Runner, list_files
from chaincor.workflows.scripts.study import timestep_study

SCRIPTS = Path(__file__).parents[1] / "docs" / "examples" / "scripts"
# Observable, time steps of the study, seeds, tolerance, and how many times finer the reference runs
# are.
CASES = {
    "reflecting_wall": ("restitution", "timestep=0.05:0.001:8", None, 5e-3, 20.0),
    "spring_chain": ("position", "timestep=0.2:0.01:8", None, 1e-4, 10.0),
    "langevin": ("energy", "timestep=0.1:0.01:6", 12, 4e-2, 1.0),
    "melt_drift": ("fluctuation", "timestep=0.008:0.001:6", None, 1e-4, 4.0),
    "bond_stretch": ("frequency", "timestep=0.2:0.01:8", None, 1e-4, 10.0),
    "crystal_energy": ("energy", "timestep=0.2:0.01:8", 5, 1e-5, 10.0),
}
FRESH, JUDGES = 6, 4


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=list(CASES))
    options = parser.parse_args()
    print("| script | verdict | order | tolerance | advice | judge | worst error followed | kept |")
    print("|---" * 8 + "|")
    for name in options.names:
        print(row(name), flush=True)


def row(name: str) -> str:
    """Study a script, follow the advice, and return a row of the table."""
    word, vary, seeds, tolerance, finer = CASES[name]
    script, pattern = SCRIPTS / f"{name}.in", rf"^{word} = (\S+)$"
    phases = None if seeds else 8
    study = timestep_study(
        script, observable=pattern, vary=vary, seeds=seeds, phases=phases, tolerance=tolerance
    )
    (ladder,) = study.ladders[0].numbers
    verdict, advice = ladder.verdict, ladder.advice
    order = "-" if verdict.order is None else f"{verdict.order:.2f} +- {verdict.order_error:.2f}"
    head = f"| {name} | {verdict.kind} | {order} | {tolerance:g} |"
    if advice is None or not advice.tried:
        return f"{head} none on the ladder | - | - | - |"
    random = np.random.default_rng(99)
    with tempfile.TemporaryDirectory() as scratch:
        asked, command = RequestedNumbers(pattern, ()), find_lmp_command() or "lmp"
        runner = Runner(script, list_files(SCRIPTS), asked, command, Path(scratch), 3600.0)

        def run(step: float) -> float:
            variables = {"timestep": f"{step:.9g}"}
            if seeds:
                variables["seed"] = str(random.integers(10**7, 10**8))
            done = runner.run("run", Change(variables=variables))
            assert done.numbers, done.failure
            return done.numbers[pattern].value

        def mean(step: float, runs: int) -> float:
            return float(np.mean([run(step * random.uniform(0.98, 1.0)) for _ in range(runs)]))

        # If a quantity scatters, the reference is a mean, and the error of this mean is added to
        # the tolerance.
        judged = [
            mean(study.ladders[0].values[-1] / finer, 1)
            for _ in range(4 * JUDGES if seeds else JUDGES)
        ]
        reference_value = float(np.mean(judged))
        bar = 2.0 * float(np.std(judged, ddof=1)) / math.sqrt(len(judged))
        errors = [abs(mean(advice.value, advice.runs) - reference_value) for _ in range(FRESH)]
    shutil.rmtree(study.kept, ignore_errors=True) if study.kept else None
    many = "" if advice.runs == 1 else f", mean of {advice.runs} seeds"
    kept = "yes" if max(errors) <= tolerance + bar else "NO"
    return (
        f"{head} timestep {advice.value:g}{many} | {reference_value:.8g} +- {bar:.1e} | "
        f"{max(errors):.1e} | {kept} |"
    )


if __name__ == "__main__":
    main()
