"""The input script of a collision that the engine runs command by command, to be kept beside it."""

import math
from dataclasses import replace
from typing import Literal

from lammps_inputs.bond_table import BondTable, tabulate
from lammps_inputs.chain_data import format_chain_data, initial_chain
from lammps_inputs.numerics import Numerics
from lammps_inputs.scene import Scene
from lammps_inputs.script import DATA_FILE, SCENE_FILE, SCRIPT_FILE, TABLE_FILE, render_job
from workflows.engines.ending import longest_collision, look_interval, quiet_time
from workflows.engines.reference_steps import STEP_SCHEMES


def job_script(
    scene: Scene,
    numerics: Numerics,
    table: BondTable | None,
    dump_steps: int | Literal["contacts"] | None = None,
) -> str:
    """
    Render a script that ends by the same rule as the engine.

    Parameters
    ----------
    scene : Scene
        The collision.
    numerics : Numerics
        With Verlet steps.
    table : BondTable or None
        The bond table; None for LAMMPS's own harmonic bond.
    dump_steps : int or "contacts" or None
        See :func:`~lammps_inputs.script.render_job`.

    Returns
    -------
    str
        The script's text.
    """
    stiffness = scene.bond.stiffness
    look = look_interval(scene.particles, stiffness)
    return render_job(
        scene,
        numerics,
        table,
        quiet_factor=quiet_time(1, stiffness),
        cap=longest_collision(scene.particles, stiffness),
        look_steps=math.ceil(look / numerics.timestep),
        dump_steps=dump_steps,
    )


def kept_files(scene: Scene, numerics: Numerics, table: BondTable | None) -> dict[str, str]:
    """
    Return what makes a kept folder a job: ``lmp -in in.chain`` runs it, and the scene is in it.

    A script takes Verlet steps only. Where the engine composed its steps of several, those of the
    script are as long as theirs on the average.

    Parameters
    ----------
    scene : Scene
        The collision.
    numerics : Numerics
        How the engine runs it.
    table : BondTable or None
        Its bond table.

    Returns
    -------
    dict
        Names and contents of the files; with a bond table and a data file where those of the
        engine, which gives broken bonds another table on the way, do not suit a script.
    """
    files = {}
    if table is not None and table.far is not None:
        bond_range = float(table.lengths[0]), table.longest
        table = tabulate(scene.bond, bond_range, numerics.table, numerics.table_points)
        files[TABLE_FILE] = table.to_text()
        files[DATA_FILE] = format_chain_data(*initial_chain(scene.particles, scene.impact_velocity))
    scheme, step = numerics.scheme, numerics.timestep
    note = ""
    if scheme != "verlet":
        numerics = replace(
            numerics, scheme="verlet", timestep=step / STEP_SCHEMES[scheme].evaluations
        )
        note = (
            f"# The engine ran this collision with {scheme} steps of {step:g}, which a script\n"
            "# cannot take. This one takes as many Verlet steps in all, and is less accurate.\n"
        )
    files[SCRIPT_FILE] = note + job_script(scene, numerics, table)
    if isinstance(scene.potential, str):
        changes = dict.fromkeys({"save", "dump", "arrays"} & scene.model_fields_set)
        if scene.bond_file is not None:  # the job lies elsewhere
            changes["bond_file"] = scene.bond_file.resolve()
        files[SCENE_FILE] = scene.replace(**changes).to_toml()
    return files
