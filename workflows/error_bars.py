"""Error bars of the restitution: what a second step, a table and rounding say about it."""

import math
import sys

import numpy as np

from analysis.modes import mode_energies
from lammps_inputs.scene import Scene
from workflows.engines.compositions import COMPOSITIONS
from workflows.engines.outcome import Outcome
from workflows.result import ErrorBar

# With the number at step h and a run at 2h, theory gives |difference|/(2^p - 1). The shares below
# are larger, because near-grazing contacts make the convergence irregular; they are what the
# study of honest bars (tests/benchmarks/honest_bars.py) was found to need.
COARSER_SHARE = {"verlet": 1.5, "order4": 0.6, "order6": 0.45, "order8": 0.4} | {
    # 16383 times smaller in theory.
    "extrapolated14": 1.0 / 32.0
}

# With the number at step h and a run at h/2 the difference is the error, less its 2^p-th part.
FINER_SHARE = 1.5
# The stock wall's error does not shrink regularly: a difference says only its size.
REFLECT_SHARE = 3.0

# |change of eta| * v0 / |force error|: at most 0.5 for splines over potentials, speeds and rows
# up to n = 100, more in long chains that break; the kinks of a linear table also cost the
# integrator its order.
TABLE_SENSITIVITY = {"spline": 2.0, "linear": 5.0}

# LAMMPS holds absolute coordinates, up to n, rounded to n eps against displacements of order v0.
# Largest |error of eta| / (n eps/v0) measured, n = 10 to 300, v0 = 1e-11 to 1e-3: below 6, and
# below 15 where a drift of one stage is so short that its rounding is no longer random.
ROUNDING_SENSITIVITY = 6.0
SHORT_DRIFT_SENSITIVITY = 15.0
SHORT_DRIFT = 1e3  # in units of n eps
# Long chains that break amplify rounding, up to 1e7 times. The in-house engine, whose strains are
# rounded to eps, tells how much; coordinates are rounded n/v0 times more coarsely.
JITTER_SENSITIVITY = 6.0
# At tolerances below so many times the plain rounding, its amplification must be looked at.
JITTER_MATTERS = 1e5
# The arithmetic itself: the squared mean of n velocities over hundreds of contacts.
ARITHMETIC_FLOOR = 1e-14
# Single velocities and times feel a table and rounding more than their mean does; measured over
# the reference cases.
ARRAY_SENSITIVITY = 30.0


def table_error(outcome: Outcome, scene: Scene) -> float:
    """
    Return the error of eta due to the bond table, from its certificate.

    Parameters
    ----------
    outcome : Outcome
        A run; without a table its error is zero.
    scene : Scene
        The collision.

    Returns
    -------
    float
        Force error in units of v0 (the scale of all forces), times the measured sensitivity.
    """
    certificate = outcome.details.get("table")
    if certificate is None:
        return 0.0
    sensitivity = TABLE_SENSITIVITY[certificate["style"]]
    return sensitivity * certificate["force_error"] / scene.impact_velocity


def rounding_error(engine: str, scene: Scene, stage: float | None = None) -> float:
    """
    Return the error of eta due to rounding.

    Parameters
    ----------
    engine : str
        ``lammps`` holds absolute coordinates; the others hold strains.
    scene : Scene
        The collision.
    stage : float or None
        Shortest stage of a step; None where it is not known yet.

    Returns
    -------
    float
        The arithmetic's floor, which grows with n, and for absolute coordinates n eps/v0 times
        what was measured.
    """
    n, v0 = scene.particles, scene.impact_velocity
    arithmetic = ARITHMETIC_FLOOR * n
    if engine != "lammps":
        return arithmetic
    grain = n * sys.float_info.epsilon
    short = stage is not None and v0 * stage < SHORT_DRIFT * grain
    sensitivity = SHORT_DRIFT_SENSITIVITY if short else ROUNDING_SENSITIVITY
    return arithmetic + sensitivity * grain / v0


def rounding_of(outcome: Outcome, scene: Scene) -> float:
    """
    Return the error of eta due to rounding in a run.

    Parameters
    ----------
    outcome : Outcome
        The run.
    scene : Scene
        The collision.

    Returns
    -------
    float
        See :func:`rounding_error`.
    """
    stage = None
    if outcome.engine == "lammps" and outcome.timestep is not None:
        stage = outcome.timestep * min(abs(w) for w in COMPOSITIONS[outcome.scheme].weights)
    return rounding_error(outcome.engine, scene, stage)


def jitter_error(engine: str, jitter: float, scene: Scene) -> float:
    """
    Return the error of eta due to rounding that the collision amplifies.

    Parameters
    ----------
    engine : str
        ``lammps`` holds absolute coordinates; the others hold strains.
    jitter : float
        Change of the in-house eta when all roundings change.
    scene : Scene
        The collision.

    Returns
    -------
    float
        The jitter with a reserve; for LAMMPS, times how much more coarsely coordinates are rounded
        than strains.
    """
    coarser = scene.particles / scene.impact_velocity if engine == "lammps" else 1.0
    return JITTER_SENSITIVITY * jitter * coarser


def ending_error(outcome: Outcome, scene: Scene) -> float:
    r"""
    Return how much eta could change by contacts that may still come.

    Parameters
    ----------
    outcome : Outcome
        A run.
    scene : Scene
        The collision.

    Returns
    -------
    float
        :math:`(2 \bar v + w) w/v_0^2` with the mean velocity that they could give, w; zero where
        the end is proved or argued.
    """
    gained = outcome.ending.missed_momentum / scene.particles
    mean = abs(float(np.mean(outcome.velocities)))
    return (2.0 * mean + gained) * gained / scene.impact_velocity**2


def error_bar(outcome: Outcome, scene: Scene, step: float | None, jitter: float = 0.0) -> ErrorBar:
    """
    Gather the error bar of a run.

    Parameters
    ----------
    outcome : Outcome
        The run that gives the number.
    scene : Scene
        The collision.
    step : float or None
        Error due to the finite step, where it was measured.
    jitter : float
        Change of the in-house eta when all roundings change, where it was measured.

    Returns
    -------
    ErrorBar
        Its parts.
    """
    return ErrorBar(
        step=step,
        table=table_error(outcome, scene),
        rounding=max(rounding_of(outcome, scene), jitter_error(outcome.engine, jitter, scene)),
        ending=ending_error(outcome, scene),
    )


def spreads(first: Outcome, second: Outcome, scene: Scene, floor: float) -> dict[str, float]:
    """
    Return how far the arrays of two runs at different steps lie apart, floors included.

    Parameters
    ----------
    first, second : Outcome
        Two runs of the same collision.
    scene : Scene
        The collision.
    floor : float
        Relative error from causes that both runs share: tables and rounding.

    Returns
    -------
    dict
        Largest absolute difference of contact times and speeds, velocities and mode energies;
        inf where the numbers of contacts differ.
    """
    v0, stiffness = scene.impact_velocity, scene.bond.stiffness
    energy = 0.5 * scene.particles * v0**2
    pairs = {
        "contact_times": (first.contact_times, second.contact_times, first.duration),
        "contact_speeds": (first.contact_speeds, second.contact_speeds, v0),
        "velocities": (first.velocities, second.velocities, v0),
        "mode_energies": (
            mode_energies(first.displacements, first.velocities, stiffness),
            mode_energies(second.displacements, second.velocities, stiffness),
            energy,
        ),
    }
    found = {}
    for name, (one, other, scale) in pairs.items():
        if len(one) != len(other):
            found[name] = math.inf
            continue
        difference = float(np.max(np.abs(one - other), initial=0.0))
        found[name] = difference + ARRAY_SENSITIVITY * floor * scale
    return found
