"""Shortest script of a collision, with only LAMMPS's own commands."""

import math

from chaincor.lammps_inputs.bond_table import KEYWORDS
from chaincor.lammps_inputs.contact_script import number
from chaincor.lammps_inputs.errors import InputError, SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script import TABLE_FILE, rendered, setup_values, values_in_units
from chaincor.lammps_inputs.script_plan import JobWishes, ScriptPlan

# Verlet step of a plain script, in units of 1/omega of the fastest bond at its natural length.
_TIMESTEP = 0.01
# Duration of a script: the time of the last contact, multiplied by the first number, plus the
# second number. The additional time is needed because the stock wall may detect a contact slightly
# late. It does no harm, because eta does not change after the last contact.
_LONGER, _MARGIN = 1.1, 5.0
_LINES_OF_THERMO = 20


def is_plain(wishes: JobWishes) -> bool:
    """
    Return whether the user wants a plain script, or replaces it by a whole script.

    Raises InputError if the user wants both, or if a wanted feature is not part of such scripts.
    """
    whole = wishes.whole
    if whole is None and not wishes.plain:
        return False
    if whole is not None and wishes.plain:
        raise InputError(
            "--plain and a template that is a whole script exclude each other. Drop one"
        )
    besides = {
        "frames": wishes.dump,
        "a restartable job": wishes.restartable,
        "guards": wishes.guards,
        "a list of contacts": wishes.contacts,
        "a template": wishes.template is not whole,
    }
    for name, wanted in besides.items():
        if wanted:
            kind = "a plain script" if whole is None else "a template that is a whole script"
            raise InputError(f"{kind} and {name} exclude each other. Drop one")
    return True


def plain_scene(scene: Scene) -> Scene:
    """
    Return a scene with the numerics of a plain script: Verlet steps and the stock wall.

    Raises SceneError if a plain script cannot run the scene.
    """
    line = scene.line
    if line.soft or not line.rigid:
        raise SceneError(
            "a plain script needs a rigid wall with hard contact, for which LAMMPS has a command, "
            + ("but the contact is soft" if line.soft else "but the target is free")
            + ". Leave --plain out, or use such a wall"
        )
    given = {
        "wall": (scene.wall, "reflect"),
        "scheme": (scene.scheme, "verlet"),
        "tolerance": (scene.tolerance, None),
    }
    for name, (value, only) in given.items():
        if value is not None and value != only:
            raise SceneError(
                f"a plain script cannot use {name} {value}"
                + ("" if only else ", because it computes no error bar")
                + f". Leave out {name} or --plain"
            )
    step = scene.timestep or _TIMESTEP / scene.problem.fast_stiffness**0.5
    return scene.replace(wall="reflect", scheme="verlet", timestep=step, error=False)


def render_plain(scene: Scene, plan: ScriptPlan, approach: float, wishes: JobWishes) -> str:
    """
    Render a script of about twenty commands for ``lmp -in``, or a user's own template.

    The scene is the result of `plain_scene`. The duration of the run is computed from two times:
    the last contact of the same collision in the reference engine, and the time of `approach` until
    the first contact. Raises SceneError if the end of the collision is unknown.
    """
    if plan.end is None:
        raise SceneError(
            "the duration of this collision is unknown, but a plain script needs it. Leave "
            "--plain out: other scripts detect the end themselves"
        )
    assert scene.timestep is not None
    time = wishes.units.time
    duration = approach + _LONGER * plan.end.last_contact_time + _MARGIN
    steps = math.ceil(duration / scene.timestep)
    values = setup_values(Numerics.from_scene(scene), plan.table, ".")
    values |= values_in_units(scene.problem, wishes.units)
    values |= {
        "given_velocities": scene.temperature is not None or scene.initial is not None,
        "step": number(time * scene.timestep),
        "duration": number(time * steps * scene.timestep * (1.0 - 1e-9)),
        "steps": steps,
        "every": max(steps // _LINES_OF_THERMO, 1),
        "contacts": plan.end.contacts,
        "last": f"{time * (approach + plan.end.last_contact_time):.6g}",
    }
    if wishes.whole is None:
        return rendered("plain", values)
    values |= {
        "particles": scene.particles,
        "timestep": values["step"],
        "wall": "fix wall all wall/reflect xlo 0.0",
        "bond_coeff": values["spring"] if plan.table is None else f"{TABLE_FILE} {KEYWORDS[0]}",
    }
    if plan.table is not None:
        values["bond_table"] = TABLE_FILE
    return wishes.whole.render(values)
