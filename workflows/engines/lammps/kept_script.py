"""Write an input script that repeats a collision of the engine."""

from dataclasses import replace

from chaincor.lammps_inputs.bond_table import BondTable, tabulate
from chaincor.lammps_inputs.chain_data import format_data
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.schemes import COMPOSITIONS, SCHEMES, Composition, Scheme
from chaincor.lammps_inputs.script import (
    DATA_FILE,
    SCENE_FILE,
    SCRIPT_FILE,
    TABLE_FILE,
    render_job,
)
from chaincor.lammps_inputs.script_plan import (
    NO_WISHES,
    EndTimes,
    ExpectedEnd,
    JobWishes,
    ScriptedSteps,
    ScriptPlan,
)
from chaincor.workflows.engines.end_watch import longest_collision, look_interval
from chaincor.workflows.engines.ending import sound_round_trip
from chaincor.workflows.engines.lammps.contact import grading
from chaincor.workflows.engines.lammps.lammps_collision import PATIENCE
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference.coarse_run import bonds_in_flight
from chaincor.workflows.engines.schemes import STEP_SCHEMES

# The range of strains after the last contact is widened by this factor, because these strains are
# known only to some parts in 1e3 for unbroken chains.
_MARGIN = 1.2
# A script uses this scheme if LAMMPS scripts cannot take the steps of the engine's scheme.
_INSTEAD: Scheme = "order8"


def job_script(problem: Problem, plan: ScriptPlan, wishes: JobWishes = NO_WISHES) -> str:
    """Return a script that follows the chain at least as long as the reference engine."""
    span, stiffness, time = problem.longest_body, problem.slow_stiffness, wishes.units.time
    quiet = sound_round_trip(span, stiffness)
    last = 0.0 if plan.end is None else plan.end.last_contact_time
    cap = longest_collision(span, stiffness, max(quiet, last)) + problem.approach_time
    times = EndTimes(time * quiet, time * cap, time * look_interval(span, stiffness))
    return render_job(problem, plan, times, _scripted_steps(problem, plan.numerics, time), wishes)


def _scripted_steps(problem: Problem, numerics: Numerics, time: float) -> ScriptedSteps | None:
    """
    Return the composed steps of a script; None for Verlet steps.

    `time` is the chain's unit of time, expressed in the script's unit. Raises SceneError if a
    script cannot take steps of this scheme.
    """
    if numerics.scheme == "verlet":
        return None
    composition = SCHEMES[numerics.scheme]
    if not isinstance(composition, Composition):
        raise SceneError(
            f"scheme is '{numerics.scheme}', but a script can only take the steps of "
            f"{', '.join(COMPOSITIONS)}. Give one of these, or use `chaincor run`, which drives "
            "LAMMPS step by step"
        )
    graded = grading(problem.line.contact.onset, problem.fast_stiffness, composition.order)
    return ScriptedSteps(
        weights=composition.weights,
        order=composition.order,
        citation=composition.source,
        coarse=time * (COMPOSITIONS["verlet"].usual_step / problem.fast_stiffness**0.5),
        patience=time * (PATIENCE / problem.slow_stiffness**0.5),
        graded=None if graded is None else (time * graded[0], graded[1]),
    )


def time_after_last_contact(problem: Problem) -> float:
    """
    Return the time for which a script follows a chain after its last contact.

    The bond table of the script must cover all bond lengths during this time.
    """
    span, stiffness = problem.longest_body, problem.slow_stiffness
    return sound_round_trip(span, stiffness) + 2.0 * look_interval(span, stiffness)


def expected_end(outcome: Outcome) -> ExpectedEnd:
    """Return the end of a collision, at which a script that repeats the collision must also end."""
    times = outcome.contact_times
    last, kind = float(times[-1]), outcome.ending.kind
    return ExpectedEnd(last, len(times), kind, outcome.lasted, outcome.bond_min)


def kept_files(
    problem: Problem,
    numerics: Numerics,
    table: BondTable | None,
    outcome: Outcome | None,
    scene: str | None,
) -> dict[str, str]:
    """
    Return the files with which ``lmp -in in.chain`` runs a saved job.

    The files include the text of the `scene`. The script uses the same composed steps as the
    engine. If the engine extrapolated, the script takes steps of order 8, with the same number of
    Verlet steps per time.

    The script has only one bond table and follows the chain longer than the engine. If the engine's
    bond table and data file do not suit the script, the files include new ones. `outcome` is None
    while it is unknown.
    """
    files = {}
    scouted = None if outcome is None else expected_end(outcome)
    if table is not None:
        bond_range = _range_in_flight(table, outcome)
        if table.far is not None or bond_range != (float(table.lengths[0]), table.longest):
            table = tabulate(problem.bond, bond_range, numerics.table, numerics.table_points)
            files[TABLE_FILE] = table.to_text()
            files[DATA_FILE] = format_data(problem.line)
    scheme, step = numerics.scheme, numerics.timestep
    note = ""
    if scheme not in COMPOSITIONS:
        share = STEP_SCHEMES[_INSTEAD].evaluations / STEP_SCHEMES[scheme].evaluations
        numerics = replace(numerics, scheme=_INSTEAD, timestep=share * step)
        note = (
            f"# The engine ran this collision with {scheme} steps of {step:g}, which a script\n"
            f"# cannot take. This one takes as many Verlet steps, in steps of {_INSTEAD}, and is\n"
            "# less accurate.\n"
        )
    files[SCRIPT_FILE] = note + job_script(problem, ScriptPlan(numerics, table, scouted))
    if scene is not None:
        files[SCENE_FILE] = scene
    return files


def _range_in_flight(table: BondTable, outcome: Outcome | None) -> tuple[float, float]:
    """Return the range of bond lengths in the engine's run and in the later flight."""
    low, high = float(table.lengths[0]), table.longest
    if outcome is None or outcome.problem.longest_body == 1:
        return low, high
    shortest, longest = bonds_in_flight(outcome, time_after_last_contact(outcome.problem))
    # `bonds_in_flight` follows the chain with coarse steps; the bond lengths in the script may
    # differ slightly.
    return min(low, 1.0 - _MARGIN * (1.0 - shortest)), max(high, 1.0 + _MARGIN * (longest - 1.0))
