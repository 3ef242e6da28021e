"""Numerics and error bars of scripts that LAMMPS runs alone: all that can be told beforehand."""

import math
from dataclasses import dataclass, replace

import numpy as np

from chaincor.lammps_inputs.bond_table import MARGIN_BINS, BondTable, tabulate
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import DEFAULT_TOLERANCE, Scene
from chaincor.lammps_inputs.script import ScriptedBar
from chaincor.workflows.accuracy.by_lammps import choose
from chaincor.workflows.accuracy.convergence import Converged
from chaincor.workflows.accuracy.error_bars import (
    COARSER_SHARE,
    LEAST_SHARE,
    PROOF_SHARE,
    PROOF_STEPS,
    TABLE_SENSITIVITY,
    ending_error,
)
from chaincor.workflows.accuracy.meet import goal_of
from chaincor.workflows.accuracy.scouting import Scouting, scouted_run, scouting_from
from chaincor.workflows.accuracy.step_search import error_near
from chaincor.workflows.engines.lammps.engine import guess_bond_range
from chaincor.workflows.engines.lammps.kept_script import flown_on
from chaincor.workflows.engines.rounding import jitter_error, rounding_of_steps
from chaincor.workflows.engines.schemes import STEP_SCHEMES

# The number's step and twice that, as where the engine meets a tolerance.
_MULTIPLES = (1.0, 2.0)
# With another velocity nothing but the two runs tells the error: with steps that resolve the
# motion it is well below their difference.
_ALONE = 1.0
# Speed, in units of v0, at which a bond may open while particle 1 is behind the wall.
_OVERSHOOT = 2.0
# LAMMPS kicks, drifts and kicks; the in-house engine drifts first, with half the error.
_LAMMPS_OVER_IN_HOUSE = 2.0
# Part of the goal that the step may use.
_STEP_SHARE = 0.5
_MOST_PROBES = 20_001


@dataclass(frozen=True)
class ScriptPlan:
    """
    What a script is made of, besides the scene.

    Attributes
    ----------
    numerics : Numerics
        Wall, scheme and step.
    table : BondTable or None
        The bonds; None for LAMMPS's own harmonic one.
    scouting : Scouting or None
        What the in-house run said; None where it could not tell.
    bar : ScriptedBar or None
        How the script tells its error; None where it shall not or cannot.
    tolerance : float or None
        What the numerics were chosen for.
    """

    numerics: Numerics
    table: BondTable | None
    scouting: Scouting | None
    bar: ScriptedBar | None
    tolerance: float | None


def plan_script(scene: Scene) -> ScriptPlan:
    """
    Choose what a script of a scene runs with, without LAMMPS.

    Explicit numerics are taken as they are, with the proof that the engine gives them; otherwise
    those that usually meet the tolerance are, with the error bar of its parts. Raises RunError
    where none do.
    """
    if scene.explicit:
        return _as_given(scene)
    return _for_tolerance(scene, scene.tolerance or DEFAULT_TOLERANCE)


def _as_given(scene: Scene) -> ScriptPlan:
    numerics = Numerics.from_scene(scene)
    truth = scouted_run(scene)
    scouting = None if truth is None else scouting_from(truth, scene, flown_on(scene))
    table = _tabulate(scene, numerics, scouting)
    bar = None
    if scene.error and truth is not None:
        share = PROOF_SHARE[numerics.wall]
        bar = ScriptedBar(
            multiples=(1.0, *PROOF_STEPS),
            share=share,
            share_alone=share,
            table=_table_part(table, scene),
            rounding=rounding_of_steps(scene, numerics.scheme, numerics.timestep),
            ending=ending_error(truth.outcome, scene),
        )
    return ScriptPlan(numerics, table, scouting, bar, None)


def _for_tolerance(scene: Scene, tolerance: float) -> ScriptPlan:
    goal, noise = goal_of(scene, tolerance)
    choice = choose(scene, goal, noise)
    truth, numerics = choice.truth, choice.numerics
    scouting = scouting_from(truth, scene, flown_on(scene))
    numerics = replace(numerics, bond_range=None)
    # The engine refines where its two runs say so; a script has one try.
    expected = (
        COARSER_SHARE[numerics.scheme]
        * _LAMMPS_OVER_IN_HOUSE
        * error_near(scene, numerics.scheme, 2.0 * numerics.timestep, truth)
    )
    if math.isfinite(expected) and expected > _STEP_SHARE * goal:
        shrink = (_STEP_SHARE * goal / expected) ** (1.0 / STEP_SCHEMES[numerics.scheme].order)
        numerics = replace(numerics, timestep=shrink * numerics.timestep)
    table = _tabulate(scene, numerics, scouting)
    bar = _bar(scene, numerics, table, truth, goal, noise)
    return ScriptPlan(numerics, table, scouting, bar, tolerance)


def _bar(
    scene: Scene,
    numerics: Numerics,
    table: BondTable | None,
    truth: Converged,
    goal: float,
    noise: float,
) -> ScriptedBar:
    """Return the error bar that the engine gives a run that meets a tolerance."""
    scheme, share = numerics.scheme, COARSER_SHARE[numerics.scheme]
    expected = error_near(scene, scheme, numerics.timestep, truth)
    if not math.isfinite(expected):  # stopped in-house, at a step beside those of LAMMPS
        expected, share = 0.0, max(share, 2.0)
    if scene.line is not None:
        noise *= STEP_SCHEMES[scheme].amplification
    return ScriptedBar(
        multiples=_MULTIPLES,
        share=share,
        share_alone=max(share, _ALONE),
        table=_table_part(table, scene),
        rounding=max(
            rounding_of_steps(scene, scheme, numerics.timestep),
            jitter_error("lammps", noise, scene),
        ),
        ending=ending_error(truth.outcome, scene),
        yardstick=truth.restitution,
        yardstick_error=truth.error,
        least=max(_LAMMPS_OVER_IN_HOUSE * expected, LEAST_SHARE * goal),
    )


def _tabulate(scene: Scene, numerics: Numerics, scouting: Scouting | None) -> BondTable | None:
    if scene.bond.is_harmonic:
        return None
    low, high = guess_bond_range(scene) if scouting is None else scouting.table_range(scene)
    if numerics.scheme != "verlet":
        # The step that meets the wall is taken in full first, behind it; there bond 1 is stretched.
        overshot = 1.0 + _OVERSHOOT * scene.impact_velocity * max(_MULTIPLES) * numerics.timestep
        high = max(high, min(overshot, 1.0 + 0.9 * scene.bond.strain_max))
    return tabulate(
        scene.bond,
        (low, high),
        numerics.table,
        numerics.table_points,
        force_error=numerics.force_error,
    )


def _table_part(table: BondTable | None, scene: Scene) -> float:
    if table is None:
        return 0.0
    error = interpolated_force_error(table, scene.bond)
    return TABLE_SENSITIVITY[table.style] * error / scene.impact_velocity


def interpolated_force_error(table: BondTable, bond: Potential) -> float:
    """
    Return the largest error of the force that LAMMPS interpolates, away from the table's ends.

    LAMMPS's spline is the cubic one with the slopes given at both ends.
    """
    inner = table.lengths[MARGIN_BINS:-MARGIN_BINS]
    asked = np.linspace(inner[0], inner[-1], min(4 * len(inner), _MOST_PROBES))
    if table.style == "spline":
        from scipy.interpolate import CubicSpline

        low, high = table.edge_slopes
        spline = CubicSpline(table.lengths, table.forces, bc_type=((1, low), (1, high)))
        force = spline(asked)
    else:
        force = np.interp(asked, table.lengths, table.forces)
    return float(np.max(np.abs(force - bond.force(asked - 1.0))))
