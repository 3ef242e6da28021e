"""The input script of a collision that the engine runs command by command, to be kept beside it."""

from dataclasses import replace

from chaincor.lammps_inputs.bond_table import BondTable, tabulate
from chaincor.lammps_inputs.chain_data import format_data
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import FILE_KEYS, Scene
from chaincor.lammps_inputs.scene_parts.scene_file import read_from_anywhere
from chaincor.lammps_inputs.schemes import DEFAULT_TIMESTEPS, Scheme
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
    JobWishes,
    ScoutedEnd,
    ScriptedSteps,
    ScriptPlan,
)
from chaincor.workflows.engines.compositions import COMPOSITIONS, SOURCES
from chaincor.workflows.engines.end_watch import longest_collision, look_interval
from chaincor.workflows.engines.ending import sound_round_trip
from chaincor.workflows.engines.lammps.contact import approach_time, grading
from chaincor.workflows.engines.lammps.lammps_collision import PATIENCE
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference.coarse_run import bonds_in_flight
from chaincor.workflows.engines.schemes import STEP_SCHEMES

# Strains of the flight after the last contact are known to some parts in 1e3, for whole chains.
_MARGIN = 1.2
# What a script takes where the engine's steps need Python.
_INSTEAD: Scheme = "order8"


def job_script(scene: Scene, plan: ScriptPlan, wishes: JobWishes = NO_WISHES) -> str:
    """Render a script that does not end before the in-house engine, which follows a chain, does."""
    span, stiffness, time = scene.longest_body, scene.slow_stiffness, wishes.units.time
    quiet = sound_round_trip(span, stiffness)
    last = 0.0 if plan.end is None else plan.end.last_contact_time
    cap = longest_collision(span, stiffness, max(quiet, last)) + approach_time(scene)
    times = EndTimes(time * quiet, time * cap, time * look_interval(span, stiffness))
    return render_job(scene, plan, times, _scripted_steps(scene, plan.numerics, time), wishes)


def _scripted_steps(scene: Scene, numerics: Numerics, time: float) -> ScriptedSteps | None:
    """
    Return how a script composes steps; SceneError where it cannot.

    `time` is the chain's unit of it in the script's.
    """
    if numerics.scheme == "verlet":
        return None
    if numerics.scheme not in COMPOSITIONS:
        raise SceneError(
            f"scheme is '{numerics.scheme}'; a script can do {', '.join(COMPOSITIONS)}: give one "
            "of these, or use `chaincor run`, which drives LAMMPS step by step"
        )
    composition = COMPOSITIONS[numerics.scheme]
    graded = grading(scene, composition.order)
    return ScriptedSteps(
        weights=composition.weights,
        order=composition.order,
        citation=SOURCES[numerics.scheme],
        coarse=time * (DEFAULT_TIMESTEPS["verlet"] / scene.fast_stiffness**0.5),
        patience=time * (PATIENCE / scene.slow_stiffness**0.5),
        graded=None if graded is None else (time * graded[0], graded[1]),
    )


def flown_on(scene: Scene) -> float:
    """
    Return for how long a script follows a chain after its last contact.

    For that time its bond table must hold the bonds.
    """
    span, stiffness = scene.longest_body, scene.slow_stiffness
    return sound_round_trip(span, stiffness) + 2.0 * look_interval(span, stiffness)


def scouted_end(outcome: Outcome) -> ScoutedEnd:
    """Return what a script must know of the end of a collision that it runs again."""
    times = outcome.contact_times
    return ScoutedEnd(float(times[-1]), len(times), outcome.ending.kind)


def kept_files(
    scene: Scene, numerics: Numerics, table: BondTable | None, outcome: Outcome | None
) -> dict[str, str]:
    """
    Return what makes a kept folder a job: ``lmp -in in.chain`` runs it, and the scene is in it.

    A script composes its steps as the engine did. Where that extrapolated, those of the script are
    of order 8, with as many Verlet steps on the average.

    A bond table and a data file are among the files where those of the engine do not suit a script,
    which has one table and follows the chain longer. `outcome` is None while it is not known.
    """
    files = {}
    scouted = None if outcome is None else scouted_end(outcome)
    if table is not None:
        bond_range = _range_in_flight(scene, table, outcome)
        if table.far is not None or bond_range != (float(table.lengths[0]), table.longest):
            table = tabulate(scene.bond, bond_range, numerics.table, numerics.table_points)
            files[TABLE_FILE] = table.to_text()
            files[DATA_FILE] = format_data(scene.line)
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
    files[SCRIPT_FILE] = note + job_script(scene, ScriptPlan(numerics, table, scouted))
    if isinstance(scene.potential, str):
        files[SCENE_FILE] = read_from_anywhere(scene.without(*FILE_KEYS)).to_toml()
    return files


def _range_in_flight(
    scene: Scene, table: BondTable, outcome: Outcome | None
) -> tuple[float, float]:
    """Return the lengths of a table for the engine's bonds, and for those of the flight after."""
    low, high = float(table.lengths[0]), table.longest
    if outcome is None or scene.longest_body == 1:
        return low, high
    shortest, longest = bonds_in_flight(scene, outcome, flown_on(scene))
    # Coarse steps, and steps of the script's own, may see other bonds.
    return min(low, 1.0 - _MARGIN * (1.0 - shortest)), max(high, 1.0 + _MARGIN * (longest - 1.0))
