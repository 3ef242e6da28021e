"""The answer to a tolerance: a run, its error bar, and why it is not met where it is not."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from chaincor.analysis.error_bar import ErrorBar
from chaincor.analysis.modes import mode_energies
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.reference_runs import relative_velocity
from chaincor.workflows.durations import format_duration
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import hard_sphere
from chaincor.workflows.engines.rounding import amplified_rounding, coarsening, rounding_of
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.engines.time_limit import time_limit
from chaincor.workflows.measured import measured

# With explicit numerics, the number at step h is proved by runs at these shares of it: half of it,
# and, as phases of contacts make errors irregular, two that are no simple fraction.
PROOF_STEPS = (0.5, 0.54, 0.93)
# Error over the largest difference to those runs, by wall. In theory it is 4/3 for order 2 and near
# 1 for higher ones; the stock wall's error does not shrink regularly, and a difference says its
# size.
PROOF_SHARE: dict[str, float] = measured("proof_share")

# |change of eta| * v0 / |force error|; the kinks of a linear table also cost the integrator its
# order. By choice at least what long chains that break need.
TABLE_SENSITIVITY: dict[str, float] = measured("table_sensitivity", {"spline": 2.0, "linear": 5.0})

# Single velocities and times feel a table and rounding more than their mean does.
ARRAY_SENSITIVITY: float = measured("array_sensitivity")


@dataclass(frozen=True)
class BoundedRun:
    """A run that was asked to meet a tolerance."""

    outcome: Outcome  #: The run that gives the number.
    bar: ErrorBar  #: Its error.
    #: Change of the in-house eta when all roundings change, as far as it was looked for.
    rounding_sensitivity: float = 0.0
    #: Why the tolerance is not met, where it was compared with one and is not.
    reason: str | None = None
    #: PilotRun, choice and proof, for the record.
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def error(self) -> float:
        """All of the bar; inf where there is none."""
        return math.inf if self.bar.total is None else self.bar.total


def bounded_run(
    scene: Scene,
    outcome: Outcome,
    step: float,
    other: Outcome | dict[str, float],
    tries: list[dict[str, float]] | None = None,
    sensitivity: float = 0.0,
) -> BoundedRun:
    """
    Gather the error bar of a run, not yet compared with a tolerance.

    `step` is its error due to the finite step, `other` a run that it differs from by more than
    that, or by how much in each array; `tries` are the steps and errors on the way. For
    `sensitivity` see :func:`error_bar`.
    """
    bar = error_bar(outcome, scene, step, sensitivity)
    details: dict[str, Any] = {"spread": spread_of(scene, outcome, other)}
    if tries is not None:
        details["choice"] = {"tries": tries}
    return BoundedRun(outcome, bar, sensitivity, details=details)


def reason_missed(found: BoundedRun, tolerance: float) -> str | None:
    """Say why a tolerance is not met; None where it is."""
    outcome, bar = found.outcome, found.bar
    if bar.total is None or bar.step is None or bar.total <= tolerance:
        return None
    parts = {name: getattr(bar, name) for name in ("step", "table", "rounding", "ending")}
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


def decade_above(floor: float, tolerance: float) -> float:
    """Return the goal of a tolerance where roundings leave this floor."""
    return max(decade_within(tolerance), decade_within(floor))


def decade_within(tolerance: float) -> float:
    """Return the largest power of ten that is not above a tolerance."""
    # The logarithm of a power of ten may come out a last digit short of a whole number.
    return 10.0 ** math.floor(math.log10(tolerance) + 1e-9)


def table_error(outcome: Outcome, scene: Scene) -> float:
    """
    Return the error of eta due to the bond table, from its certificate.

    That is the force error in units of v0 (the scale of all forces), times the measured
    sensitivity; zero without a table.
    """
    certificate = outcome.details.get("table")
    if certificate is None:
        return 0.0
    return table_error_of(certificate["style"], certificate["force_error"], scene)


def table_error_of(style: str, force_error: float, scene: Scene) -> float:
    """Return the error of eta due to a table of a style with a largest error of the force."""
    return TABLE_SENSITIVITY[style] * force_error / scene.impact_velocity


def ending_error(outcome: Outcome, scene: Scene) -> float:
    r"""
    Return how much eta could change by contacts that may still come.

    :math:`(2 \bar v + w) w/v_0^2` with the mean velocity that they could give, w; zero where the
    end is proved or argued.
    """
    if outcome.ending.missed_momentum == 0.0:
        return 0.0
    gained = outcome.ending.missed_momentum / scene.line.reduced_mass
    mean = abs(relative_velocity(scene.line, outcome))
    return (2.0 * mean + gained) * gained / scene.impact_velocity**2


def error_bar(
    outcome: Outcome, scene: Scene, step: float | None, sensitivity: float = 0.0
) -> ErrorBar:
    """
    Gather the error bar of a run.

    `step` is the error due to the finite step, `sensitivity` the change of the in-house eta when
    all roundings change, where they were measured.
    """
    if outcome.engine == "lammps":
        sensitivity *= coarsening(outcome.scheme)
    elif outcome.scheme in STEP_SCHEMES:
        sensitivity *= STEP_SCHEMES[outcome.scheme].amplification
    rounding = max(
        rounding_of(outcome, scene), amplified_rounding(outcome.engine, sensitivity, scene)
    )
    return ErrorBar(
        step=step,
        table=table_error(outcome, scene),
        rounding=rounding,
        ending=ending_error(outcome, scene),
    )


def differences(first: Outcome, second: Outcome, scene: Scene) -> dict[str, float]:
    """
    Return how far the arrays of two runs at different steps lie apart.

    By array, the largest absolute difference of contact times and speeds, velocities and mode
    energies; inf where the numbers of contacts differ.
    """
    stiffness, masses = scene.bond.stiffness, scene.line.chain_masses
    pairs = {
        "contact_times": (first.contact_times, second.contact_times),
        "contact_speeds": (first.contact_speeds, second.contact_speeds),
        "velocities": (first.velocities, second.velocities),
        "target_velocities": (first.target_velocities, second.target_velocities),
    }
    if not scene.bond.only_pushes:  # whose bodies have no modes
        pairs["mode_energies"] = (
            mode_energies(first.displacements, first.velocities, stiffness, masses),
            mode_energies(second.displacements, second.velocities, stiffness, masses),
        )
    return {name: farthest(*pair) for name, pair in pairs.items()}


def farthest(one: Array, other: Array) -> float:
    """Return the largest absolute difference of two arrays; inf where they differ in length."""
    if len(one) != len(other):
        return math.inf
    return float(np.max(np.abs(one - other), initial=0.0))


def spread_of(
    scene: Scene, outcome: Outcome, other: Outcome | dict[str, float]
) -> dict[str, float]:
    """
    Return by array how far two runs lie apart, for comparisons with other integrators.

    `other` is one of them, or the :func:`differences`. What both err by together is included:
    tables and rounding.
    """
    apart = differences(outcome, other, scene) if isinstance(other, Outcome) else other
    floor = table_error(outcome, scene) + rounding_of(outcome, scene)
    v0 = scene.impact_velocity
    scales = {
        "contact_times": scene.longest_body / scene.slow_stiffness**0.5,
        "contact_speeds": v0,
        "velocities": v0,
        "target_velocities": v0,
        "mode_energies": 0.5 * v0**2 * float(np.sum(scene.line.chain_masses)),
    }
    return {
        name: difference + ARRAY_SENSITIVITY * floor * scales[name]
        for name, difference in apart.items()
    }
