"""Print the composed step H that each published reference value needs, order 8 in LAMMPS.

Run: python -m benchmarks.timestep_table
"""

import argparse
from dataclasses import dataclass
from typing import Any

from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.errors import RunError
from tests.reference_cases import CASES, case_scene

# From coarse to fine; the first that is good enough, with every finer one good as well, is needed.
TIMESTEPS = (0.4, 0.3, 0.2, 0.15, 0.1, 0.07, 0.05, 0.035, 0.025, 0.018, 0.0125)
FAST = 2.0  # units of v*
LIMITS = {"slow": 1e-8, "fast": 2e-8}


def case_limit(case: dict[str, Any]) -> float:
    """Return the error of eta that a case may have."""
    return LIMITS["fast" if case.get("speed_over_vstar", 0.0) >= FAST else "slow"]


@dataclass(frozen=True)
class Trial:
    """One run of a case: its step, the error of eta, whether the contacts agree, its time."""

    timestep: float
    error: float
    same_contacts: bool
    seconds: float


def attempt(case: dict[str, Any], timestep: float) -> Trial:
    """Run a case with order 8 at one step."""
    scene = case_scene(case)
    outcome = lammps.run(scene, Numerics(scheme="order8", timestep=timestep))
    eta = restitution(outcome.velocities, scene.impact_velocity)
    return Trial(
        timestep,
        abs(float(eta) - case["restitution"]),
        len(outcome.contact_times) == case["contacts"],
        outcome.seconds,
    )


def largest_timestep(case: dict[str, Any]) -> Trial:
    """Return the coarsest trial that is good and below which the next two are good as well."""
    good: list[Trial] = []
    for timestep in TIMESTEPS:
        try:
            trial = attempt(case, timestep)
        except RunError:
            good = []
            continue
        good = [*good, trial] if trial.error <= case_limit(case) and trial.same_contacts else []
        if len(good) == 3:
            return good[0]
    raise AssertionError(f"no step of {TIMESTEPS} is good for {case}")


def main() -> None:
    """Print the table."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    print("| potential | n | speed | eta | H | error | contacts | seconds |")
    print("|---|---|---|---|---|---|---|---|")
    for case in CASES:
        trial = largest_timestep(case)
        name = case["potential"] + (f" {case['r']}" if "r" in case else "")
        speed = f"{case['speed_over_vstar']} v*" if "speed_over_vstar" in case else case["velocity"]
        print(
            f"| {name} | {case['particles']} | {speed} | {case['restitution']:.9f} "
            f"| {trial.timestep:g} | {trial.error:.1e} | {case['contacts']} "
            f"| {trial.seconds:.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
