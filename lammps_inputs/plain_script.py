"""The shortest script of a collision: what LAMMPS's own commands can do, and no more."""

import math

from chaincor.lammps_inputs.bond_table import BondTable
from chaincor.lammps_inputs.contact_script import number
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.own_templates.own_template import OwnTemplate
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script import ScoutedEnd, render_plain_template
from chaincor.lammps_inputs.units.unit_system import UnitSystem

# Velocity Verlet resolves the fastest bond at rest with so many steps in 1/omega.
_TIMESTEP = 0.01
# After the last contact nothing changes; the stock wall's may come a little later than the true.
_LONGER, _MARGIN = 1.1, 5.0
_LINES_OF_THERMO = 20


def plain_scene(scene: Scene) -> Scene:
    """
    Return a scene with the numerics of a plain script: Verlet steps and LAMMPS's stock wall.

    Raises SceneError for what no such script can do.
    """
    line = scene.line
    if line.soft or not line.rigid:
        raise SceneError(
            "a plain script is asked for, and the chain meets "
            + ("a soft contact" if line.soft else "a free target")
            + "; expected a rigid wall, for which LAMMPS has a command: leave --plain out"
        )
    given = {
        "wall": (scene.wall, "reflect"),
        "scheme": (scene.scheme, "verlet"),
        "tolerance": (scene.tolerance, None),
    }
    for name, (value, only) in given.items():
        if value is not None and value != only:
            raise SceneError(
                f"a plain script is asked for, and {name} is {value}; expected "
                + (f"{only}" if only else "none, as it tells no error")
                + f": leave {name} out, or --plain"
            )
    step = scene.timestep or _TIMESTEP / scene.fast_stiffness**0.5
    return scene.replace(wall="reflect", scheme="verlet", timestep=step, error=False)


def render_plain(
    scene: Scene,
    table: BondTable | None,
    end: ScoutedEnd,
    approach: float,
    units: UnitSystem,
    template: OwnTemplate | None = None,
) -> str:
    """
    Render a script of some twenty commands for ``lmp -in``.

    Parameters
    ----------
    scene : Scene
        As `plain_scene` returns it.
    table : BondTable or None
        The bond table; None for LAMMPS's own harmonic bond.
    end : ScoutedEnd
        How the same collision ended in-house, which tells how long to run.
    approach : float
        Time until the first contact.
    units : UnitSystem
        In which LAMMPS computes.
    template : OwnTemplate or None
        A whole script of the user's own, with the same values.

    Returns
    -------
    str
        The script's text.
    """
    assert scene.timestep is not None
    duration = approach + _LONGER * end.last_contact_time + _MARGIN
    steps = math.ceil(duration / scene.timestep)
    return render_plain_template(
        scene,
        table,
        units,
        template,
        step=number(units.time * scene.timestep),
        duration=number(units.time * steps * scene.timestep * (1.0 - 1e-9)),
        steps=steps,
        every=max(steps // _LINES_OF_THERMO, 1),
        contacts=end.contacts,
        last=f"{units.time * (approach + end.last_contact_time):.6g}",
    )
