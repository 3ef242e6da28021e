"""The answer to a tolerance: a run, its error bar, and why it is not met where it is not."""

from dataclasses import dataclass, field
from typing import Any

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.error_bars import error_bar, spreads, table_error
from chaincor.workflows.durations import format_duration
from chaincor.workflows.engines.in_house import hard_sphere
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.rounding import rounding_of
from chaincor.workflows.engines.time_limit import time_limit
from chaincor.workflows.error_bar import ErrorBar


@dataclass(frozen=True)
class Answer:
    """A run that was asked to meet a tolerance."""

    outcome: Outcome  #: The run that gives the number.
    bar: ErrorBar  #: Its error.
    #: Change of the in-house eta when all roundings change, as far as it was looked for.
    rounding_sensitivity: float = 0.0
    #: Why the tolerance is not met, where it was compared with one and is not.
    reason: str | None = None
    #: Scouting, choice and proof, for the record.
    details: dict[str, Any] = field(default_factory=dict)


def answer(
    scene: Scene, outcome: Outcome, step: float, details: dict[str, Any], sensitivity: float = 0.0
) -> Answer:
    """
    Gather the error bar of a run, not yet compared with a tolerance.

    `step` is its error due to the finite step; for `sensitivity` see
    :func:`chaincor.workflows.accuracy.error_bars.error_bar`.
    """
    return Answer(
        outcome, error_bar(outcome, scene, step, sensitivity), sensitivity, details=details
    )


def reason_missed(found: Answer, tolerance: float) -> str | None:
    """Say why a tolerance is not met; None where it is."""
    outcome, bar = found.outcome, found.bar
    if bar.total is None or bar.step is None or bar.total <= tolerance:
        return None
    parts = {
        "step": bar.step,
        "table": bar.table,
        "rounding": bar.rounding,
        "ending": bar.ending,
    }
    largest = max(parts, key=lambda name: parts[name])
    coarse = "LAMMPS's coordinates have no more digits here; engine 'reference' has far more"
    remedy = {
        "step": "the collision is too sensitive for the steps that were tried",
        "table": "more rows, or more digits, would be needed",
        "rounding": coarse
        if outcome.engine == "lammps"
        else "the collision amplifies the last digit of any number; ask for less",
        "ending": "a piece of the broken chain may still hit the wall, however long it is followed",
    }[largest]
    if time_limit().was_short and largest in ("step", "table"):
        remedy = (
            f"what is finer would take longer than {format_duration(time_limit().allowed)}; allow "
            "more (--most-hours, or most_seconds in Python)"
        )
    if outcome.scheme == hard_sphere.SCHEME:
        remedy = "the chain may differ so much from hard spheres; ask for less: steps take too long"
    return (
        f"the error reached is {bar.total:.2g}, not {tolerance:g}; most of it, "
        f"{parts[largest]:.2g}, is {largest}: {remedy}"
    )


def spread_of(scene: Scene, outcome: Outcome, other: Outcome) -> dict[str, float]:
    """Return by array how far two runs lie apart, for comparisons with other integrators."""
    floor = table_error(outcome, scene) + rounding_of(outcome, scene)
    return spreads(outcome, other, scene, floor)
