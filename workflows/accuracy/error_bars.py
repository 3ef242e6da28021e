"""Error bars of the restitution: what a second step, a table and rounding say about it."""

import math
from collections.abc import Sequence

import numpy as np

from chaincor.analysis.modes import mode_energies
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.in_house_runs import relative_velocity
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.rounding import amplified_rounding, coarsening, rounding_of
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.error_bar import ErrorBar
from chaincor.workflows.measured import measured

# With explicit numerics, the number at step h is proved by runs at these shares of it: half of it,
# and, as phases of contacts make errors irregular, two that are no simple fraction.
PROOF_STEPS = (0.5, 0.54, 0.93)
# Error over the largest difference to those runs. In theory it is 4/3 for order 2 and near 1 for
# higher ones; the stock wall's error does not shrink regularly, and a difference says its size.
PROOF_SHARE: dict[str, float] = measured("proof_share")

# |change of eta| * v0 / |force error|; the kinks of a linear table also cost the integrator its
# order. By choice at least what long chains that break need.
TABLE_SENSITIVITY: dict[str, float] = measured("table_sensitivity", {"spline": 2.0, "linear": 5.0})

# Single velocities and times feel a table and rounding more than their mean does.
ARRAY_SENSITIVITY: float = measured("array_sensitivity")


def proof_error(wall: str, differences: Sequence[float]) -> float:
    """
    Return the error of eta due to the step, from runs at `PROOF_STEPS` times the step.

    It is the largest of the `differences` of their eta to the number's, times the share measured
    for the wall.
    """
    return PROOF_SHARE[wall] * max(abs(difference) for difference in differences)


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


def spreads(first: Outcome, second: Outcome, scene: Scene, floor: float) -> dict[str, float]:
    """
    Return how far the arrays of two runs at different steps lie apart, floors included.

    `floor` is the relative error from causes that both runs share: tables and rounding. By array,
    the largest absolute difference of contact times and speeds, velocities and mode energies; inf
    where the numbers of contacts differ.
    """
    stiffness, masses = scene.bond.stiffness, scene.line.chain_masses
    pairs = {
        "contact_times": (first.contact_times, second.contact_times),
        "contact_speeds": (first.contact_speeds, second.contact_speeds),
        "velocities": (first.velocities, second.velocities),
        "target_velocities": (first.target_velocities, second.target_velocities),
        "mode_energies": (
            mode_energies(first.displacements, first.velocities, stiffness, masses),
            mode_energies(second.displacements, second.velocities, stiffness, masses),
        ),
    }
    apart = {}
    for name, (one, other) in pairs.items():
        apart[name] = math.inf
        if len(one) == len(other):
            apart[name] = float(np.max(np.abs(one - other), initial=0.0))
    return with_floors(apart, scene, floor)


def with_floors(apart: dict[str, float], scene: Scene, floor: float) -> dict[str, float]:
    """Return differences of arrays with what both runs err by together, see :func:`spreads`."""
    v0 = scene.impact_velocity
    scales = {
        "contact_times": scene.span / scene.slow_stiffness**0.5,
        "contact_speeds": v0,
        "velocities": v0,
        "target_velocities": v0,
        "mode_energies": 0.5 * v0**2 * float(np.sum(scene.line.chain_masses)),
    }
    return {
        name: difference + ARRAY_SENSITIVITY * floor * scales[name]
        for name, difference in apart.items()
    }
