"""From measurements to findings to verdicts."""

from dataclasses import dataclass

from chaincor.workflows.reproduce.claims.all_claims import RULES
from chaincor.workflows.reproduce.exact_hard_spheres import run_hard_spheres
from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.findings.harmonic import (
    HarmonicLaw,
    harmonic_findings,
    harmonic_law,
)
from chaincor.workflows.reproduce.findings.lengths import length_findings
from chaincor.workflows.reproduce.findings.low_speed import low_speed_findings
from chaincor.workflows.reproduce.findings.powers import power_findings
from chaincor.workflows.reproduce.findings.speeds import speed_findings
from chaincor.workflows.reproduce.measurements import Measurements
from chaincor.workflows.reproduce.rules import Judgement, judge


@dataclass(frozen=True)
class Judged:
    """The fits to harmonic chains, and a judgement for each rule that has a finding."""

    law: HarmonicLaw
    judgements: tuple[Judgement, ...]


def judge_all(measured: Measurements) -> Judged:
    """Find all numbers and judge them."""
    law = harmonic_law(measured)
    found = {
        **harmonic_findings(measured, law),
        **speed_findings(measured),
        **length_findings(measured),
        **low_speed_findings(measured),
        **power_findings(measured),
        **_hard_spheres(measured.plan.curve_particles),
    }
    return Judged(law, tuple(judge(rule, found[rule.key]) for rule in RULES))


def _hard_spheres(particles: int) -> dict[str, Finding]:
    run = run_hard_spheres(particles)
    text = (
        f"exact event-driven run in rational numbers, n = {particles}: {run.contacts} contacts, "
        f"{run.exchanges} exchanges, energy of vibration {run.vibration}"
    )
    return {
        "hard spheres": Finding(float(run.restitution), 0.0, text),
        "hard-sphere contacts": Finding(run.contacts / particles, 0.0, text),
    }
