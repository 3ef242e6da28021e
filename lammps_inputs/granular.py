"""Columns of beads as granular jobs: LAMMPS's `pair_style granular` with its Hertz law."""

import math
from typing import Any

import numpy as np

from chaincor.lammps_inputs.chain_data import ROOM, initial_state
from chaincor.lammps_inputs.contact_script import number
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script import DATA_FILE, SAFE_PATH_CHARACTERS, rendered
from chaincor.lammps_inputs.script_plan import ScriptPlan

# LAMMPS's normal stiffness k_n multiplies sqrt(R_eff) d^(3/2). Beads of diameter 1 have R_eff =
# 1/4, and R_eff = 1/2 at a wall.
PAIR_STIFFNESS, WALL_STIFFNESS = 2.0, math.sqrt(2.0)
_HERTZ = 1.5
# Largest sum of the overlaps of a bead with both neighbours, which leaves these apart.
_FREE = 0.9
# Factor and time, in units of the time in which two colliding beads stop each other, that a script
# adds to the last contact of the reference run. Eta does not change after the last contact.
_LONGER, _MARGIN = 1.05, 5.0


def format_beads(scene: Scene) -> str:
    """
    Format the data file of a column for ``atom_style sphere``, exact to the last bit.

    Beads of the column come first, then those of a free target, both from the contact outward. A
    bead of mass m and diameter 1 has the density 6 m/pi.
    """
    line = scene.line
    positions, velocities = bead_state(scene)
    masses = np.concatenate((line.chain_masses, line.target_masses))
    slow = max(1.0, float(np.mean(masses)) ** 0.5) * max(1.0, 2.0 * float(np.abs(velocities).max()))
    reach = ROOM * (len(masses) + 10.0 + float(np.ptp(positions))) * slow
    lines = [
        "column of beads, bead 1 nearest the wall; positions are those of centres",
        "",
        f"{len(masses)} atoms",
        "1 atom types",
        "",
        f"{-reach:.17g} {reach:.17g} xlo xhi",
        "-1 1 ylo yhi",
        "-1 1 zlo zhi",
        "",
        "Atoms # sphere",
        "",
    ]
    densities = 6.0 / math.pi * masses
    rows = zip(densities.tolist(), positions.tolist(), strict=True)
    lines += [f"{i} 1 1.0 {density:.17g} {x:.17g} 0 0" for i, (density, x) in enumerate(rows, 1)]
    lines += ["", "Velocities", ""]
    lines += [f"{i} {v:.17g} 0 0 0 0 0" for i, v in enumerate(velocities.tolist(), 1)]
    return "\n".join(lines) + "\n"


def bead_state(scene: Scene) -> Any:
    """Return positions of the centres and velocities; bead 1 at 0 touches the wall."""
    positions, velocities = initial_state(scene.line)
    positions[scene.particles :] -= 1.0  # beads of a target touch where centres are 1 apart
    return positions, velocities


def _values(scene: Scene, folder: str) -> dict[str, Any]:
    contact = scene.contact_law
    stiffness = contact.strength if contact.soft else None
    wall = None if scene.target_particles else stiffness
    return {
        "data": f"{folder}/{DATA_FILE}",
        "pair": f"{number(PAIR_STIFFNESS)} 0.0",
        "damping": "velocity",
        "wall": None if wall is None else f"{number(WALL_STIFFNESS * wall)} 0.0",
    }


def render_granular_setup(scene: Scene, timestep: float, folder: str) -> str:
    """Render the commands that set up a column for a run driven from Python."""
    assert set(folder) <= SAFE_PATH_CHARACTERS, "the engine has judged its folder"
    return rendered(
        "granular", _values(scene, folder) | {"script": False, "step": number(timestep)}
    )


def render_granular_job(scene: Scene, plan: ScriptPlan) -> str:
    """
    Render a script for ``lmp -in``: two runs, at the step and twice the step, and the error bar.

    The duration of a run follows from the reference run; at a lower velocity it grows as the
    inverse velocity, which is more than any column needs.
    """
    assert plan.end is not None
    assert plan.bar is not None
    v0, line = scene.impact_velocity, scene.line
    unit = line.overlap(v0) / v0 if line.soft else 1.0 / scene.fast_stiffness**0.5
    overlap = max(1.0 - plan.end.bond_min, 1e-300)
    fastest = v0 * (_FREE / (2.0 * overlap)) ** ((_HERTZ + 1.0) / 2.0)
    if fastest < v0:
        raise SceneError(
            f"velocity is {v0:g}, and beads overlap by up to {overlap:.2g} of a diameter: those "
            f"next but one may touch, too. Expected less than {fastest:.2g}"
        )
    duration = _LONGER * plan.end.lasted + _MARGIN * unit
    values = _values(scene, ".") | {
        "script": True,
        "title": f"A column of {scene.particles} beads meets "
        + ("a wall" if line.rigid else f"{line.targets} beads at rest"),
        "velocity": number(v0),
        "given_velocities": scene.comes_moving,
        "targets": line.targets,
        "fastest": number(fastest),
        "column": scene.particles,
        "parting": "(vcm(column,x)-vcm(target,x))" if line.targets else "vcm(all,x)",
        "hard": not line.soft,
        "mass": number(float(line.chain_masses[0])),
        "step": number(plan.numerics.timestep),
        "duration": number(duration),
        "multiples": plan.bar.multiples,
        "bar": plan.bar,
        "tolerance": None if plan.tolerance is None else number(plan.tolerance),
        "contacts": plan.end.contacts,
        "last": f"{plan.end.lasted:.6g}",
    }
    return rendered("granular", values)
