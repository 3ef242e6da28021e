"""Choose numerics and error bars for scripts that LAMMPS runs without Python."""

import math
from dataclasses import replace

import numpy as np

from chaincor.lammps_inputs.bond_table import (
    FEWEST_ROWS,
    MARGIN_BINS,
    MOST_ROWS,
    BondTable,
    choose_rows,
    tabulate,
    with_margin,
)
from chaincor.lammps_inputs.bonds.interpolation import interpolate
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script_plan import ScriptedBar, ScriptPlan
from chaincor.workflows.accuracy.bounded_run import (
    PROOF_SHARE,
    ending_error,
    error_bar,
    table_error_of,
)
from chaincor.workflows.accuracy.by_lammps import COARSER, SCRIPTED_SCHEMES, LammpsSearch
from chaincor.workflows.accuracy.pilot_run import PilotRun, pilot_from_run, usual_pilot_run
from chaincor.workflows.accuracy.plan import plan
from chaincor.workflows.accuracy.solve import target_error_of
from chaincor.workflows.accuracy.step_guess import effective_order
from chaincor.workflows.accuracy.step_proof import share_of_difference
from chaincor.workflows.accuracy.table_rows import rows_error
from chaincor.workflows.engines.end_watch import longest_collision
from chaincor.workflows.engines.ending import sound_round_trip
from chaincor.workflows.engines.lammps.engine import guess_bond_range
from chaincor.workflows.engines.lammps.kept_script import time_after_last_contact
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.rounding import amplified_rounding, rounding_of_steps
from chaincor.workflows.errors import ToleranceError

# The script runs at these multiples of its step, like the engine's search for a tolerance. The
# first run gives eta.
_MULTIPLES = (1.0, COARSER)
# If a user changes the velocity in the script, the error bar is this multiple of the difference
# between the two runs. If the steps resolve the motion, the true error is well below the
# difference.
_ALONE = 1.0
# During a step that ends behind the wall, bond 1 may lengthen at this multiple of v0. Before the
# step, it has at most its largest length in front of the wall.
_OVERSHOOT = 4.0
# Errors of the stock wall can stretch bonds of a warm chain beyond the lengths in the
# reference run. The range of the table is therefore wider by this factor.
_OTHERWISE = 1.25
# With explicit numerics, a warning is issued if the error of the reference run exceeds this value.
_UNSURE = 0.01
# A script may find later contacts than the pilot run. The bond table therefore covers the flight
# for this multiple of the time of the last contact in the pilot run.
_LATER = 2.0
# The largest velocity whose bond lengths a table covers is searched up to _MOST_FASTER times the
# velocity of the scene, with _BISECTIONS bisections.
_MOST_FASTER, _BISECTIONS = 100.0, 30
_MOST_PROBES = 20_001
# For shared tables, ranges and numbers of rows are rounded up to geometric sequences with this
# ratio. Similar scenes then need equal tables.
_SHARED_RATIO = 1.25


def plan_script(
    scene: Scene, table_range: tuple[float, float] | None = None, *, shared_table: bool = False
) -> ScriptPlan:
    """
    Choose the numerics of a scene's script, without LAMMPS.

    Explicit numerics are used unchanged, with the same proof runs as in the engine. Otherwise
    numerics are chosen that usually meet the tolerance; the error bar is the sum of its parts.
    `table_range` contains bond lengths that the table must cover in addition to the lengths in this
    collision. With `shared_table`, the range and the number of rows are rounded up, so that similar
    scenes get equal tables. Raises RunError if no numerics meet the tolerance, and SceneError if no
    table can cover the range.
    """
    if table_range is not None:
        _refuse_range(scene, table_range)
    planned, target_error, sensitivity = plan(scene), 0.0, 0.0
    asked, numerics = scene.asked_tolerance, planned.numerics
    if asked is None:
        pilot = usual_pilot_run(scene.problem, time_after_last_contact(scene.problem))
    else:
        target_error, sensitivity = target_error_of(planned)
        search = LammpsSearch(
            scene.problem, target_error, sensitivity, SCRIPTED_SCHEMES, planned.files
        )
        numerics = replace(search.numerics, bond_range=None)
        pilot = pilot_from_run(search.pilot.reference, time_after_last_contact(scene.problem))
    assert numerics is not None
    doubt = None if pilot is None else _doubt(scene, pilot, sensitivity)
    if pilot is not None and doubt is not None:
        pilot = pilot_from_run(pilot.reference, _flown_on_at_most(scene, pilot))
    table = _tabulate(scene, numerics, pilot, table_range, shared=shared_table)
    bar = None
    if pilot is not None and (scene.error or asked is not None):
        known = PROOF_SHARE[numerics.wall]
        bar = ScriptedBar(
            multiples=(1.0, *planned.proofs),
            share=known,
            share_alone=known,
            table=_table_part(table, scene, pilot.outcome, target_error),
            rounding=rounding_of_steps(scene.problem, numerics.scheme, numerics.timestep),
            ending=ending_error(pilot.outcome),
        )
        if asked is not None:
            order = effective_order(scene.problem, numerics.scheme)
            bar = replace(
                bar,
                multiples=_MULTIPLES,
                share=share_of_difference(order, COARSER),
                share_alone=_ALONE,
                rounding=max(
                    bar.rounding, amplified_rounding("lammps", sensitivity, scene.problem)
                ),
                reference_solution=pilot.reference.restitution,
                reference_error=pilot.reference.error,
            )
    return ScriptPlan(
        numerics=numerics,
        table=table,
        end=None if pilot is None else pilot.end,
        bar=bar,
        tolerance=asked,
        fastest=None if table_range is None or table is None else _fastest_held(scene, table),
        doubt=doubt,
    )


def _doubt(scene: Scene, pilot: PilotRun, sensitivity: float) -> str | None:
    """
    Return why a job will probably miss its tolerance; None if it will meet the tolerance.

    Raises ToleranceError if the reference engine cannot determine eta.
    """
    found = pilot.reference
    known = error_bar(found.outcome, found.error, sensitivity).total
    assert known is not None
    if known > max(1.0, found.restitution):
        raise ToleranceError(
            f"the reference engine finds eta only as {found.restitution:.3g} +- "
            f"{known:.2g}, so eta is unknown. Take another speed or fewer particles"
        )
    asked = scene.asked_tolerance or _UNSURE
    if known <= asked:
        return None
    return (
        f"the reference engine finds eta only as {found.restitution:.3g} +- "
        f"{known:.2g}, so the error of the job will probably exceed {asked:g}. "
        "Take another speed or fewer particles, or accept this error"
    )


def _flown_on_at_most(scene: Scene, pilot: PilotRun) -> float:
    """
    Return the longest time for which a script may follow a chain after the known last contact.

    The contacts in the script may differ from those in the pilot run. A fragment that narrowly
    misses the wall in the pilot run may hit the wall in the script. The script then follows the
    chain for another full waiting time.
    """
    last = pilot.end.last_contact_time
    span, stiffness = scene.problem.longest_body, scene.problem.slow_stiffness
    longest = longest_collision(span, stiffness, max(last, sound_round_trip(span, stiffness)))
    return time_after_last_contact(scene.problem) + min(_LATER * last, longest - last)


def _refuse_range(scene: Scene, table_range: tuple[float, float]) -> None:
    if scene.bond.is_harmonic:
        raise SceneError(
            "table_range has no effect on harmonic bonds, because LAMMPS needs no "
            "table for them. Leave out table_range"
        )
    low, high = table_range
    shortest, longest = max(1.0 + scene.bond.strain_min, 0.0), 1.0 + scene.bond.strain_max
    if not shortest < low < 1.0 < high < longest:
        raise SceneError(
            f"table_range is {low:g} to {high:g}. Give a length below and a length above 1, both "
            f"between {shortest:g} and {longest:g} for {scene.bond.name} bonds, such as 0.7 1.5"
        )


def _fastest_held(scene: Scene, table: BondTable) -> float | None:
    """Return the largest velocity at which a table covers the expected bond lengths, or None."""
    line = scene.line
    if np.any(line.velocities[line.first :] != -scene.impact_velocity):
        return None
    slow, fast = scene.impact_velocity, _MOST_FASTER * scene.impact_velocity
    for _ in range(_BISECTIONS):
        middle = (slow * fast) ** 0.5
        low, high = guess_bond_range(scene.replace(speed=None, velocity=middle).problem)
        held = table.lengths[0] <= low and high <= table.longest
        slow, fast = (middle, fast) if held else (slow, middle)
    return float(f"{slow:.3g}") if slow > 1.01 * scene.impact_velocity else None


def _tabulate(
    scene: Scene,
    numerics: Numerics,
    pilot: PilotRun | None,
    table_range: tuple[float, float] | None,
    *,
    shared: bool,
) -> BondTable | None:
    if not scene.bond.is_tabulated:
        return None
    low, high = guess_bond_range(scene.problem) if pilot is None else pilot.table_range()
    if numerics.scheme != "verlet":
        # The script first completes the step in which particle 1 crosses the wall. At the end of
        # this step, particle 1 is behind the wall, and bond 1 is stretched.
        overshot = high + _OVERSHOOT * scene.impact_velocity * max(_MULTIPLES) * numerics.timestep
        high = max(high, min(overshot, 1.0 + 0.9 * scene.bond.strain_max))
    if numerics.wall == "reflect" and scene.problem.comes_moving:
        low, high = (1.0 + _OTHERWISE * (length - 1.0) for length in (low, high))
    if table_range is not None:
        low, high = min(low, table_range[0]), max(high, table_range[1])
    rows = numerics.table_points
    if shared:
        low, high = _rounded_range(scene.bond, low, high)
        if rows is None:
            span = with_margin(scene.bond, (low, high), FEWEST_ROWS)
            needed = choose_rows(scene.bond, span, numerics.table, numerics.force_error)
            rows = min(math.ceil(_rounded_up(needed)), MOST_ROWS)
    return tabulate(scene.bond, (low, high), numerics.table, rows, force_error=numerics.force_error)


def _rounded_range(bond: Potential, low: float, high: float) -> tuple[float, float]:
    """Round both ends of a range of bond lengths outward, within the limits of the bond."""
    wider = 1.0 - _rounded_up(1.0 - low), 1.0 + _rounded_up(high - 1.0)
    shortest, longest = max(1.0 + bond.strain_min, 0.0), 1.0 + bond.strain_max
    return wider[0] if wider[0] > shortest else low, wider[1] if wider[1] < longest else high


def _rounded_up(value: float) -> float:
    """Return the next element of the geometric sequence for shared tables."""
    if value <= 0.0:
        return value
    return _SHARED_RATIO ** math.ceil(math.log(value, _SHARED_RATIO))


def _table_part(table: BondTable | None, scene: Scene, outcome: Outcome, tolerance: float) -> float:
    """Return the error of eta from the table of the job, and from the table of the user, if any."""
    if table is None:
        return 0.0
    force_error = interpolated_force_error(table, scene.bond)
    own = table_error_of(table.style, force_error, scene.impact_velocity)
    return own + rows_error(scene, outcome, tolerance)


def interpolated_force_error(table: BondTable, bond: Potential) -> float:
    """Return the largest error of the interpolated force, apart from the ends of the table."""
    inner = table.lengths[MARGIN_BINS:-MARGIN_BINS]
    asked = np.linspace(inner[0], inner[-1], min(4 * len(inner), _MOST_PROBES))
    force = interpolate(table.style, table.lengths, table.forces, table.edge_slopes, asked)
    return float(np.max(np.abs(force - bond.force(asked - 1.0))))
