"""Store a run with its error bar, and compute the parts of error bars."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from chaincor.analysis.error_bar import ErrorBar
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.durations import format_duration
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import hard_sphere
from chaincor.workflows.engines.rounding import amplified_rounding, coarsening, rounding_of
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.engines.time_limit import time_limit
from chaincor.workflows.measured import measured

# Runs at these multiples of the step h measure the error of a run with explicit numerics at h. Two
# multiples are not simple fractions, because errors depend irregularly on the times of contacts
# within a step.
PROOF_STEPS = (0.5, 0.54, 0.93)
# For each wall model: error of a run, divided by its largest difference from the runs at these
# multiples. In theory this ratio is 4/3 for order 2 and near 1 for higher orders. The error of the
# stock wall does not shrink regularly; only the largest difference shows the size of this error.
PROOF_SHARE: dict[str, float] = measured("proof_share")

# Upper bounds on |change of eta| v0/|force error| for errors of the tabulated force. The kinks of a
# linear table also reduce the order of the integrator. The second argument contains lower limits of
# the bounds; they are choices that suffice for long chains that break.
TABLE_SENSITIVITY: dict[str, float] = measured("table_sensitivity", {"spline": 2.0, "linear": 5.0})

# Errors from tables and rounding affect single velocities and times more strongly than the mean
# velocity, by this factor.
ARRAY_SENSITIVITY: float = measured("array_sensitivity")


@dataclass(frozen=True)
class BoundedRun:
    """Run with its error bar."""

    outcome: Outcome  #: Outcome of the run.
    bar: ErrorBar  #: Error bar of the run.
    #: Change of eta in the reference engine when all rounding errors change; 0 if not measured.
    rounding_sensitivity: float = 0.0
    #: Reason why the run misses its tolerance; None if the run meets its tolerance or has no
    #: tolerance.
    reason: str | None = None
    #: Data on the pilot run, the choice of numerics and the proof, for the record.
    details: dict[str, Any] = field(default_factory=dict)
    #: Runs of the same collision with which this run was compared.
    others: tuple[Outcome, ...] = ()

    @property
    def error(self) -> float:
        """Total of the error bar; inf if there is none."""
        return math.inf if self.bar.total is None else self.bar.total


def bounded_run(
    outcome: Outcome,
    step: float,
    other: Outcome | dict[str, float],
    tries: list[dict[str, float]] | None = None,
    sensitivity: float = 0.0,
) -> BoundedRun:
    """
    Return a run with its error bar, before any comparison with a tolerance.

    `step` is the error due to the finite step. `other` is a run that differs from this run by more
    than `step`, or the largest difference in each array. `tries` lists the steps and errors of the
    search. For `sensitivity` see :func:`error_bar`.
    """
    bar = error_bar(outcome, step, sensitivity)
    details: dict[str, Any] = {"spread": spread_of(outcome, other)}
    if tries is not None:
        details["choice"] = {"tries": tries}
    others = (other,) if isinstance(other, Outcome) else ()
    return BoundedRun(outcome, bar, sensitivity, details=details, others=others)


def reason_missed(found: BoundedRun, tolerance: float) -> str | None:
    """Return the reason why a run misses its tolerance; None if it meets the tolerance."""
    outcome, bar = found.outcome, found.bar
    if bar.total is None or bar.step is None or bar.total <= tolerance:
        return None
    parts = {name: getattr(bar, name) for name in ("step", "table", "rounding", "ending")}
    largest = max(parts, key=lambda name: parts[name])
    coarse = "rounding in LAMMPS's absolute coordinates limits the accuracy; use engine 'reference'"
    remedy = {
        "step": "the collision is too sensitive for the steps that were tried",
        "table": "give a table with more rows or more digits",
        "rounding": coarse
        if outcome.engine == "lammps"
        else "the collision amplifies rounding errors; give a larger tolerance",
        "ending": "a piece of the broken chain may still hit the wall, however long it is followed",
    }[largest]
    if time_limit().was_short and largest in ("step", "table"):
        remedy = (
            f"finer steps would take longer than {format_duration(time_limit().allowed)}; allow "
            "more time (--most-hours, or most_seconds in Python)"
        )
    if outcome.scheme == hard_sphere.SCHEME:
        remedy = (
            "the chain may differ this much from hard spheres, and integration would take too "
            "long; give a larger tolerance"
        )
    return (
        f"the error reached is {bar.total:.2g}, not {tolerance:g}; most of it, "
        f"{parts[largest]:.2g}, is {largest}: {remedy}"
    )


def decade_above(floor: float, tolerance: float) -> float:
    """Return the target error, a power of ten, for a tolerance and a rounding error `floor`."""
    return max(decade_within(tolerance), decade_within(floor))


def decade_within(tolerance: float) -> float:
    """Return the largest power of ten up to a tolerance."""
    # The computed logarithm of a power of ten may be slightly below an integer.
    return 10.0 ** math.floor(math.log10(tolerance) + 1e-9)


def table_error(outcome: Outcome) -> float:
    """
    Return the error of eta due to the bond table, from its certificate.

    The error is the force error in units of v0 (the scale of all forces) times the measured
    sensitivity. It is zero without a table.
    """
    certificate = outcome.details.get("table")
    if certificate is None:
        return 0.0
    speed = outcome.problem.impact_velocity
    return table_error_of(certificate["style"], certificate["force_error"], speed)


def table_error_of(style: str, force_error: float, impact_velocity: float) -> float:
    """Return the error of eta due to a bond table whose force errors are at most `force_error`."""
    return TABLE_SENSITIVITY[style] * force_error / impact_velocity


def ending_error(outcome: Outcome) -> float:
    r"""
    Return the largest change of eta that possible later contacts could cause.

    The change is :math:`(2 \bar v + w) w/v_0^2`, where :math:`\bar v` is the mean velocity and w is
    the largest change of the mean velocity due to later contacts. The change is zero if the end of
    the collision is classified as proved or argued.
    """
    if outcome.ending.missed_momentum == 0.0:
        return 0.0
    problem = outcome.problem
    gained = outcome.ending.missed_momentum / problem.line.reduced_mass
    mean = abs(outcome.separation_velocity)
    return (2.0 * mean + gained) * gained / problem.impact_velocity**2


def error_bar(outcome: Outcome, step: float | None, sensitivity: float = 0.0) -> ErrorBar:
    """
    Return the error bar of a run.

    `step` is the error due to the finite step, None if it was not measured. `sensitivity` is the
    change of eta in the reference engine when all rounding errors change, 0 if it was not measured.
    """
    if outcome.engine == "lammps":
        sensitivity *= coarsening(outcome.scheme)
    elif outcome.scheme in STEP_SCHEMES:
        sensitivity *= STEP_SCHEMES[outcome.scheme].amplification
    rounding = max(
        rounding_of(outcome),
        amplified_rounding(outcome.engine, sensitivity, outcome.problem),
    )
    return ErrorBar(
        step=step,
        table=table_error(outcome),
        rounding=rounding,
        ending=ending_error(outcome),
    )


def differences(first: Outcome, second: Outcome) -> dict[str, float]:
    """
    Return the differences between the arrays of two runs at different steps.

    The arrays are contact times and speeds, velocities and mode energies. The result contains the
    largest absolute difference in each array. The difference is inf if the arrays have different
    lengths.
    """
    pairs = {
        "contact_times": (first.contact_times, second.contact_times),
        "contact_speeds": (first.contact_speeds, second.contact_speeds),
        "velocities": (first.velocities, second.velocities),
        "target_velocities": (first.target_velocities, second.target_velocities),
    }
    if not first.problem.bond.only_pushes:  # beads have no modes
        pairs["mode_energies"] = (first.mode_energies, second.mode_energies)
    return {name: farthest(*pair) for name, pair in pairs.items()}


def farthest(one: Array, other: Array) -> float:
    """Return the largest absolute difference between two arrays; inf if their lengths differ."""
    if len(one) != len(other):
        return math.inf
    return float(np.max(np.abs(one - other), initial=0.0))


def spread_of(outcome: Outcome, other: Outcome | dict[str, float]) -> dict[str, float]:
    """
    Return bounds on the error of each array, for comparison with other integrators.

    `other` is a run at another step, or the :func:`differences` from this run. Errors that both
    runs share, from tables and rounding, are added.
    """
    apart = differences(outcome, other) if isinstance(other, Outcome) else other
    floor = table_error(outcome) + rounding_of(outcome)
    problem = outcome.problem
    v0 = problem.impact_velocity
    scales = {
        "contact_times": problem.longest_body / problem.slow_stiffness**0.5,
        "contact_speeds": v0,
        "velocities": v0,
        "target_velocities": v0,
        "mode_energies": 0.5 * v0**2 * problem.line.chain_mass,
    }
    return {
        name: difference + ARRAY_SENSITIVITY * floor * scales[name]
        for name, difference in apart.items()
    }
