"""Formulas and commands in a script for two bodies and their contact."""

from typing import Any

from chaincor.lammps_inputs.chain_data import initial_state
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem


def number(value: float) -> str:
    """Format a number in the shortest decimal form that LAMMPS reads back to the same bits."""
    return repr(float(value))


def displacement(particles: int, alone: bool = True, length: float = 1.0) -> str:
    """Return the formula of the displacements of all particles, in the chain and its target."""
    unit = "" if length == 1.0 else f"{number(length)}*"
    if alone:
        return f"x-{unit}(id-1)"
    return f"x-{unit}(id<={particles})*(id-1)+{unit}(id>{particles})*(id-{particles + 1})"


def contact_force(line: Line, only: str = "", unit: float = 1.0, length: float = 1.0) -> list[str]:
    """
    Return the commands that define the force between soft bodies that overlap.

    `only` is a factor of the force, for example a condition. `unit` and `length` are the chain's
    units of force and length, expressed in the script's units.
    """
    place = None if line.rigid else len(line.chain_masses) + 1
    overlap = "(0.0-x[1])" if place is None else f"(x[{place}]-x[1])"
    force = line.contact.lammps_force(overlap, unit, length)
    commands = [f"variable        push equal {only}{force}", "group           struck id 1"]
    if place is not None:
        commands += [
            f"variable        pull equal -{only}{force}",
            f"group           met id {place}",
        ]
    return commands


def contact_force_on(line: Line) -> list[str]:
    """Return the commands that switch on the force between soft bodies at the next set-up."""
    pull = [] if line.rigid else ["fix             pull met addforce v_pull 0.0 0.0"]
    return ["fix             push struck addforce v_push 0.0 0.0", *pull]


def contact_force_off(line: Line) -> list[str]:
    """Return the commands that switch off the force between soft bodies."""
    return ["unfix           push", *([] if line.rigid else ["unfix           pull"])]


def contact_values(problem: Problem, units: UnitSystem) -> dict[str, Any]:
    """
    Return the formulas of a script that depend on the bodies, for the template.

    The formulas include `gap`, its first derivative `gap_velocity` and its second derivative
    `gap_acceleration`. For soft bodies their signs are chosen such that the gap falls through 0 at
    each event. `parting` is the relative velocity of the bodies. Further values describe the effect
    of a contact, and whether users can set the velocity.
    """
    line, n = problem.line, problem.particles
    targets = line.targets
    place = n + 1 if targets else None
    gap, gap_velocity, gap_acceleration = "x[1]", "vx[1]", "fx[1]"
    if not line.is_standard:
        gap_acceleration = f"(fx[1]/{number(line.chain_masses[0])})"
    if place is not None:
        gap, gap_velocity = f"(x[1]-x[{place}])", f"(vx[1]-vx[{place}])"
        gap_acceleration = f"({gap_acceleration}-fx[{place}]/{number(line.target_masses[0])})"
    if units != CHAIN_UNITS:
        gap_acceleration = (
            f"({number(units.force_to_acceleration / units.mass)}*{gap_acceleration})"
        )
    soft = line.soft
    if soft:
        gap, gap_velocity, gap_acceleration = (
            f"(v_side*{formula})" for formula in (gap, gap_velocity, gap_acceleration)
        )
    chain = "chain" if targets else "all"
    positions, velocities = initial_state(line)
    values: dict[str, Any] = {
        "gap": gap,
        "gap_velocity": gap_velocity,
        "gap_acceleration": gap_acceleration,
        # Twice the reduced mass of the two particles at the contact.
        "doubled_mass": number(2.0 * units.mass)
        if line.is_standard
        else f"2.0*{number(units.mass * line.contact_mass)}",
        "chain": chain,
        "targets": targets,
        "place": place,
        "parting": "(vcm(chain,x)-vcm(target,x))" if targets else "vcm(all,x)",
        "displacement": displacement(n, not targets, units.length),
        "columns": f"id type x y z vx vy vz {'mol ' if targets else ''}v_displacement v_time",
        "soft": soft,
        "approaches": bool(positions[0] > 0.0 or velocities[0] >= 0.0),
        "first_mass": number(units.mass * line.chain_masses[0]),
        "target_mass": number(units.mass * line.target_masses[0]) if targets else None,
        "given_velocities": problem.comes_moving,
    }
    if soft:
        given = "-mass(target)*vcm(target,x)" if targets else "mass(all)*vcm(all,x)"
        values |= {
            "given": given,
            "define_force": [
                *contact_force(line, "(v_side<0.0)*", units.force, units.length),
                *contact_force_on(line),
            ],
        }
    return values
