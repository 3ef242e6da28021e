"""Columns of beads as LAMMPS jobs with the Hertz law of `pair_style granular`."""

import math
from typing import Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.hertz import HERTZ, Hertz
from chaincor.lammps_inputs.bonds.table_text import section_text
from chaincor.lammps_inputs.chain_data import ROOM, initial_state
from chaincor.lammps_inputs.contact_script import contact_force, contact_force_on, number
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.script import DATA_FILE, SAFE_PATH_CHARACTERS, TABLE_FILE, rendered
from chaincor.lammps_inputs.script_plan import ScriptPlan

# LAMMPS's normal stiffness k_n multiplies sqrt(R_eff) d^(3/2). Two beads of diameter 1 have R_eff =
# 1/4; a bead at a wall has R_eff = 1/2.
PAIR_STIFFNESS, WALL_STIFFNESS = 2.0, math.sqrt(2.0)
# Largest sum of the overlaps of a bead with both neighbours. With a larger sum, the neighbours
# would almost touch each other.
_FREE = 0.9
# Duration of a script: the time of the last contact in the reference run, multiplied by the first
# number, plus the second number times the time in which two colliding beads stop each other. The
# additional time does no harm, because eta does not change after the last contact.
_LONGER, _MARGIN = 1.05, 5.0
#: Usual number of rows of the force table, and an upper bound on the error of eta due to the
#: interpolation between these rows.
ROWS, TABLE_ERROR = 100_000, 1e-8
# The force table extends to _DEEPER times the overlap of two beads that have all energy of the
# column, but at most to the overlap _DEEPEST.
_DEEPER, _DEEPEST = 1.02, 0.95


def format_beads(problem: Problem) -> str:
    """
    Format the data file of a column for ``atom_style sphere``, exact to the last bit.

    Beads of the column come first, followed by those of a free target. Both are in order from the
    contact outward. A bead of mass m and diameter 1 has the density 6 m/pi.
    """
    line = problem.line
    positions, velocities = bead_state(problem)
    kinds, types = _kinds(line)
    masses, diameters = kinds[types - 1].T
    slow = max(1.0, float(np.mean(masses)) ** 0.5) * max(1.0, 2.0 * float(np.abs(velocities).max()))
    reach = ROOM * (len(masses) + 10.0 + float(np.ptp(positions))) * slow
    lines = [
        "column of beads, bead 1 nearest the wall; positions are those of centres",
        "",
        f"{len(masses)} atoms",
        f"{len(kinds)} atom types",
        "",
        f"{-reach:.17g} {reach:.17g} xlo xhi",
        "-1 1 ylo yhi",
        "-1 1 zlo zhi",
        "",
        "Atoms # sphere",
        "",
    ]
    densities = 6.0 / math.pi * masses / diameters**3
    columns = (each.tolist() for each in (types, diameters, densities, positions))
    lines += [
        f"{i} {kind} {diameter:.17g} {density:.17g} {x:.17g} 0 0"
        for i, (kind, diameter, density, x) in enumerate(zip(*columns, strict=True), 1)
    ]
    lines += ["", "Velocities", ""]
    lines += [f"{i} {v:.17g} 0 0 0 0 0" for i, v in enumerate(velocities.tolist(), 1)]
    return "\n".join(lines) + "\n"


def bead_rests(line: Line) -> Array:
    """Return centres of beads that just touch, in the column and then in a free target."""
    diameters = np.ones(len(line.chain_masses)) if line.diameters is None else line.diameters
    column = np.cumsum(np.append(0.0, 0.5 * (diameters[1:] + diameters[:-1])))
    return np.append(column, -1.0 - np.arange(line.targets))


def bead_state(problem: Problem) -> tuple[Array, Array]:
    """Return positions of the centres, and velocities; bead 1 touches the wall at x = 0."""
    line = problem.line
    positions, velocities = initial_state(line)
    if line.diameters is not None:
        positions += bead_rests(line) - np.arange(problem.particles)
    positions[problem.particles :] -= 1.0  # touching beads of the two bodies have a distance of 1
    return positions, velocities


def _kinds(line: Line) -> tuple[Array, Any]:
    """Return mass and diameter of bead types, of shape (types, 2), and the type of each bead."""
    masses = np.concatenate((line.chain_masses, line.target_masses))
    diameters = np.ones(len(masses)) if line.diameters is None else line.diameters
    kinds, types = np.unique(np.stack((masses, diameters), axis=1), axis=0, return_inverse=True)
    return kinds, types.ravel() + 1


def _pairs(problem: Problem) -> list[tuple[str, str]]:
    """
    Return for each pair of bead types the two types, and stiffness and damping.

    LAMMPS's viscoelastic damping factor is eta_n0 sqrt(R_eff d) m_eff. For a given factor A, eta_n0
    therefore depends on both masses. For a dashpot, eta_n0 is A itself.
    """
    bond, line = problem.bond, problem.line
    assert isinstance(bond, Hertz)
    stiffness = number(PAIR_STIFFNESS)
    if bond.damping_law == "dashpot" or not bond.damping:
        return [("* *", f"{stiffness} {number(bond.damping)}")]
    kinds = _kinds(line)[0].tolist()
    damped = {
        f"{i} {j}": bond.damping / ((0.5 * a * b / (a + b)) ** 0.5 * (m * n / (m + n)))
        for i, (m, a) in enumerate(kinds, 1)
        for j, (n, b) in enumerate(kinds[i - 1 :], i)
    }
    return [(types, f"{stiffness} {number(eta)}") for types, eta in damped.items()]


def _first_diameter(line: Line) -> float:
    return 1.0 if line.diameters is None else float(line.diameters[0])


def _wall(problem: Problem) -> str | None:
    """Return stiffness and damping of a soft wall; m_eff is then the mass of bead 1."""
    contact, bond = problem.line.contact, problem.bond
    assert isinstance(bond, Hertz)
    if not contact.soft or problem.line.targets:
        return None
    damping = bond.damping
    if bond.damping_law == "viscoelastic":
        line = problem.line
        damping /= (0.5 * _first_diameter(line)) ** 0.5 * float(line.chain_masses[0])
    # Divide by the square root of the diameter, because both the strength of the law at the wall
    # and LAMMPS's sqrt(R_eff) contain this root.
    stiffness = WALL_STIFFNESS * contact.strength / _first_diameter(problem.line) ** 0.5
    return f"{number(stiffness)} {number(damping)}"


def _values(problem: Problem, numerics: Numerics, folder: str) -> dict[str, Any]:
    bond, rows = problem.bond, bead_table_rows(problem, numerics)
    assert isinstance(bond, Hertz)
    viscoelastic = bond.damping > 0.0 and bond.damping_law == "viscoelastic"
    at_wall = problem.line.soft and problem.line.rigid
    forced = at_wall and (rows is not None or not problem.line.contact.is_hertzian)
    return {
        "data": f"{folder}/{DATA_FILE}",
        "rows": rows,
        "table": f"{folder}/{TABLE_FILE}",
        # If the exponent is a whole number, the formula of the force is not zero for bodies that
        # are apart; the factor (x[1]<0.0) makes it zero.
        "push": contact_force(problem.line, "(x[1]<0.0)*") if forced else [],
        "push_on": contact_force_on(problem.line) if forced else [],
        "pairs": _pairs(problem),
        "damping": "viscoelastic" if viscoelastic else "velocity",
        "wall": None if forced else _wall(problem),
        "surface": number(-0.5 * _first_diameter(problem.line)),
    }


def render_granular_setup(problem: Problem, numerics: Numerics, folder: str) -> str:
    """Render the commands that set up a column for a run driven from Python."""
    assert set(folder) <= SAFE_PATH_CHARACTERS, "the engine has judged its folder"
    values = _values(problem, numerics, folder)
    return rendered("granular", values | {"script": False, "step": number(numerics.timestep)})


def render_granular_job(problem: Problem, plan: ScriptPlan) -> str:
    """
    Render a script for ``lmp -in``: runs at two time steps, and the error bar.

    The second run has twice the time step. The duration of a run is taken from the reference run.
    At a lower velocity the duration is inversely proportional to the velocity. This is longer than
    any collision of a column.
    """
    assert plan.end is not None
    assert plan.bar is not None
    assert isinstance(problem.bond, Hertz)
    v0, line = problem.impact_velocity, problem.line
    unit = line.overlap(v0) / v0 if line.soft else 1.0 / problem.fast_stiffness**0.5
    thinnest = 1.0 if line.diameters is None else float(np.min(line.diameters))
    overlap = max(1.0 - plan.end.bond_min, 1e-300) / thinnest
    fastest = v0 * (_FREE / (2.0 * overlap)) ** ((problem.bond.exponent + 1.0) / 2.0)
    if fastest < v0:
        raise SceneError(
            f"velocity is {v0:g}, so that beads overlap by up to {overlap:.2g} of a diameter and "
            f"may touch the next bead but one. Give less than {fastest:.2g}"
        )
    duration = _LONGER * plan.end.lasted + _MARGIN * unit
    values = _values(problem, plan.numerics, ".") | {
        "script": True,
        "title": f"A column of {problem.particles} beads meets "
        + ("a wall" if line.rigid else f"{line.targets} beads at rest"),
        "velocity": number(v0),
        "given_velocities": problem.comes_moving,
        "targets": line.targets,
        "fastest": number(fastest),
        "column": problem.particles,
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


def bead_table_rows(problem: Problem, numerics: Numerics) -> int | None:
    """Return the number of rows of the force table; None if LAMMPS's own law of Hertz is used."""
    bond = problem.bond
    assert isinstance(bond, Hertz)
    return numerics.table_points or (None if bond.exponent == HERTZ else ROWS)


def format_bead_table(problem: Problem, rows: int) -> str:
    """
    Format the table file of the force between beads of diameter 1.

    Rows are equally spaced in the squared distance, as LAMMPS interpolates them. The last row is
    at the distance 1, where the beads touch.
    """
    bond = problem.bond
    assert isinstance(bond, Hertz)
    overlap = min(_DEEPEST, -_DEEPER * bond.compressed_strain(problem.start_energy))
    low = 1.0 - overlap
    distances = np.sqrt(np.linspace(low * low, 1.0, rows))
    distances[-1] = 1.0
    forces, energies = (f(distances - 1.0) for f in (bond.force, bond.energy))
    slope = float(bond.curvature(low - 1.0))
    header = f"N {rows} RSQ {low:.17g} 1.0 FPRIME {-slope:.17g} 0.0"
    section = section_text("BEADS", header, (distances, energies, forces))
    return f"# force of beads, {bond.title}\n\n{section}"
