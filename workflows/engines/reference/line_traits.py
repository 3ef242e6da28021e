"""Traits of a line that its loops are compiled for, and parameters that the loops receive."""

from collections.abc import Callable
from typing import Any, NamedTuple

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.contacts.contact_law import ContactLaw
from chaincor.lammps_inputs.contacts.contact_laws import CONTACT_LAWS
from chaincor.lammps_inputs.contacts.hard import Hard
from chaincor.lammps_inputs.line import Line

WALL = "wall"


class LineTraits(NamedTuple):
    """Traits of a line that its loops are compiled for; unused features are compiled out."""

    #: ``wall`` is a hard, rigid wall, which is no particle; the gap is then the position of
    #: particle 1. Any other value is the contact law of two bodies, one of which may be a soft
    #: wall; the gap is then a strain.
    contact: str
    unit: bool  #: Whether a chain before a hard wall has masses 1 only.

    @classmethod
    def of(cls, line: Line) -> "LineTraits":
        """Return the traits of a line."""
        if line.at_wall:
            return cls(WALL, line.unit)
        return cls(line.contact.name, False)

    @property
    def at_wall(self) -> bool:
        """Whether the target is a hard, rigid wall."""
        return self.contact == WALL

    @property
    def law(self) -> type[ContactLaw]:
        """Contact law of the line."""
        return Hard if self.at_wall else CONTACT_LAWS[self.contact]


PLAIN = LineTraits(WALL, True)


class LineParameters(NamedTuple):
    """Parameters of forces and masses of a line with unequal masses or two bodies."""

    bond: Any  #: Parameters of the kernel of the potential; tuple of float.
    #: Inverse masses along x; 0 for a rigid wall that is a particle; of shape (N,).
    inverse: Array
    gap: int  #: Index of the gap among the strains; -1 before a hard wall.
    contact: Any  #: Parameters of the kernel of the contact law; tuple of float.

    @classmethod
    def of(cls, line: Line, bond: tuple[float, ...]) -> "LineParameters":
        """Return the parameters of a line; `bond` are the parameters of the kernel of its bonds."""
        inverse, gap = line.inverse_masses, line.gap
        if line.at_wall:
            inverse, gap = inverse[1:], -1
        return cls(bond, inverse.copy(), gap, line.contact.parameters)


def as_it_is(function: Callable, **_options: Any) -> Callable:
    """Return a function unchanged; replaces `LoopCompiler.register` if Python runs the loops."""
    return function


class KernelSpec(NamedTuple):
    """Source from which loops are made, whether they are compiled or run by Python."""

    #: Force -dU/dr at one strain, ``force(strain, parameters)`` with the parameters of the
    #: potential; known to the compiler.
    force: Callable
    register: Callable  #: Registers a function with the compiler, or returns it unchanged.
    kind: LineTraits = PLAIN  #: Traits of the line.


class Reading(NamedTuple):
    """Functions that read `LineParameters`, or for unit masses the parameters of the bond."""

    #: ``slice_parameters(parameters, begin, end)``: parameters of some particles alone.
    slice_parameters: Callable
    force: Callable  #: ``force(strain, parameters)``: -dU/dr.
    #: ``over_mass(number, i, parameters)``: a number divided by the mass of particle i.
    over_mass: Callable


def read_parameters(source: KernelSpec) -> Reading:
    """Return the functions with which the loops of a kind of line read its parameters."""
    of_bond, register = source.force, source.register
    if source.kind.unit:

        @register
        def slice_parameters(parameters: Any, _begin: int, _end: int) -> Any:
            return parameters

        @register
        def over_mass(number: float, _i: int, _parameters: Any) -> float:
            return number

        return Reading(slice_parameters, of_bond, over_mass)

    @register
    def around_line(parameters: LineParameters, begin: int, end: int) -> LineParameters:
        bond, inverse, gap, contact = parameters
        return LineParameters(bond, inverse[begin:end], gap - begin, contact)

    @register
    def force(strain: float, parameters: LineParameters) -> float:
        return of_bond(strain, parameters.bond)

    @register
    def weighed_line(number: float, i: int, parameters: LineParameters) -> float:
        return number * parameters.inverse[i]

    return Reading(around_line, force, weighed_line)
