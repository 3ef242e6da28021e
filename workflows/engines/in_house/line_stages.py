r"""
One Verlet step of bodies whose masses differ, or between which the contact lies.

The step is that of ``stages``, with masses,

.. math:: s_i \to s_i + d\,(v_{i+1} - v_i), \qquad v_i \to v_i + (k/m_i)\,(F(s_{i-1}) - F(s_i)).

Two bodies, and a soft wall, have the gap among their strains: it has the force :math:`K (-g)^q`
where the bodies overlap, and none elsewhere.
"""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.in_house.stages import (
    Array,
    Stages,
    State,
    array_stages,
    looped_stages,
)


class Kind(NamedTuple):
    """
    What is known of a line when its loops are compiled: what it does not name costs nothing.

    Attributes
    ----------
    contact : str
        ``wall``: hard and rigid, and no particle; the gap is the position of particle 1.
        ``two``: two bodies, hard or soft, of which one may be a soft wall; the gap is a strain.
    unit : bool
        Whether all masses are 1, of a chain before a hard wall.
    """

    contact: Literal["wall", "two"]
    unit: bool

    @classmethod
    def of(cls, line: Line) -> "Kind":
        """Return that of a line."""
        if line.at_wall:
            return cls("wall", line.unit)
        return cls("two", False)


PLAIN = Kind("wall", True)


class LineParameters(NamedTuple):
    """
    What forces and their effect depend on, where masses differ or bodies are two.

    Attributes
    ----------
    bond : tuple of float
        Of the potential's kernel.
    inverse : ndarray of shape (N,)
        1/m along x; 0 for a rigid wall that is a particle.
    gap : int
        Where among the strains the gap is; -1 before a hard wall.
    stiffness, exponent : float
        K and q of the contact.
    """

    bond: Any
    inverse: NDArray[np.float64]
    gap: int
    stiffness: float
    exponent: float

    @classmethod
    def of(cls, line: Line, bond: tuple[float, ...]) -> "LineParameters":
        """Return those of a line, with the parameters of its bonds' kernel."""
        inverse, gap = line.inverse_masses, line.gap
        if Kind.of(line).contact == "wall":
            inverse, gap = inverse[1:], -1
        return cls(bond, inverse.copy(), gap, line.contact_stiffness, line.contact_exponent)


def contact_force(gap: float, stiffness: float, exponent: float) -> float:
    """Return K d^q, which drives the bodies apart where they overlap by d = -gap."""
    return stiffness * (-gap) ** exponent if gap < 0.0 else 0.0


def looped_line_stages(force: Callable, register: Callable, kind: Kind) -> Stages:
    """
    Return the stages as loops, for a compiler.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain: ``force(strain, parameters)``; known to the compiler.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.
    kind : Kind
        Of the line.

    Returns
    -------
    Stages
        The loops; `parameters` are those of the bond for unit masses, else `LineParameters`.
    """
    plain = looped_stages(force, register)
    if kind.unit:
        return plain
    push = register(contact_force)

    # Bonds before the gap, the gap, bonds behind it: a question at every bond would cost more than
    # its force.
    @register
    def bonds_from(
        begin: int,
        end: int,
        behind: float,
        old: State,
        strain: Array,
        velocity: Array,
        drift: float,
        kick: float,
        parameters: LineParameters,
    ) -> float:
        old_strain, old_velocity = old
        bond, inverse = parameters.bond, parameters.inverse
        for i in range(begin, end):
            stretched = old_strain[i] + drift * (old_velocity[i + 1] - old_velocity[i])
            strain[i] = stretched
            ahead = force(stretched, bond)
            velocity[i] = old_velocity[i] + kick * inverse[i] * (behind - ahead)
            behind = ahead
        return behind

    @register
    def start_at_wall(
        old: State,
        strain: Array,
        velocity: Array,
        bonds: int,
        drift: float,
        kick: float,
        parameters: LineParameters,
    ) -> None:
        behind = bonds_from(0, bonds, 0.0, old, strain, velocity, drift, kick, parameters)
        velocity[bonds] = old[1][bonds] + kick * parameters.inverse[bonds] * behind

    @register
    def start_of_two(
        old: State,
        strain: Array,
        velocity: Array,
        bonds: int,
        drift: float,
        kick: float,
        parameters: LineParameters,
    ) -> None:
        old_strain, old_velocity = old
        gap, inverse = parameters.gap, parameters.inverse
        behind = bonds_from(0, gap, 0.0, old, strain, velocity, drift, kick, parameters)
        opened = old_strain[gap] + drift * (old_velocity[gap + 1] - old_velocity[gap])
        strain[gap] = opened
        ahead = push(opened, parameters.stiffness, parameters.exponent)
        velocity[gap] = old_velocity[gap] + kick * inverse[gap] * (behind - ahead)
        behind = bonds_from(gap + 1, bonds, ahead, old, strain, velocity, drift, kick, parameters)
        velocity[bonds] = old_velocity[bonds] + kick * inverse[bonds] * behind

    start = start_at_wall if kind.contact == "wall" else start_of_two

    @register
    def stage(
        strain: Array,
        velocity: Array,
        bonds: int,
        drift: float,
        kick: float,
        parameters: LineParameters,
    ) -> None:
        start((strain, velocity), strain, velocity, bonds, drift, kick, parameters)

    return plain._replace(start=start, stage=stage)


def array_line_stages(bond: Potential, kind: Kind) -> Stages:
    """
    Return the stages in NumPy, for forces that cannot be compiled.

    Parameters
    ----------
    bond : Potential
        Its `force` is called with arrays.
    kind : Kind
        Of the line.

    Returns
    -------
    Stages
        The same as NumPy expressions.
    """
    plain = array_stages(bond)
    if kind.unit:
        return plain
    two = kind.contact != "wall"

    def start(
        old: State,
        strain: Array,
        velocity: Array,
        bonds: int,
        drift: float,
        kick: float,
        parameters: LineParameters,
    ) -> None:
        plain.copy(old.strain, old.velocity, State(strain, velocity), bonds)
        stage(strain, velocity, bonds, drift, kick, parameters)

    def stage(
        strain: Array,
        velocity: Array,
        bonds: int,
        time: float,
        kick: float,
        parameters: LineParameters,
    ) -> None:
        plain.drift(strain, velocity, bonds, time)
        gap = parameters.gap
        if two:
            push = contact_force(strain[gap], parameters.stiffness, parameters.exponent)
            parts = bond.force(strain[:gap]), [push], bond.force(strain[gap + 1 : bonds])
            forces = np.concatenate(parts)
        else:
            forces = bond.force(strain[:bonds])
        pushes = np.concatenate((-forces, [0.0])) + np.concatenate(([0.0], forces))
        velocity[: bonds + 1] += kick * parameters.inverse[: bonds + 1] * pushes

    return plain._replace(start=start, stage=stage)
