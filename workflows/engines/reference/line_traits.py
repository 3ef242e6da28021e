"""What is known of a line when its loops are compiled, and what these are told of it."""

from collections.abc import Callable
from typing import Any, NamedTuple

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.contacts.contact_law import ContactLaw
from chaincor.lammps_inputs.contacts.contact_laws import CONTACT_LAWS
from chaincor.lammps_inputs.contacts.hard import Hard
from chaincor.lammps_inputs.line import Line

WALL = "wall"


class LineTraits(NamedTuple):
    """What is known of a line when its loops are compiled: what it does not name costs nothing."""

    #: ``wall``: hard and rigid, and no particle; the gap is the position of particle 1. Else the
    #: contact law of two bodies, of which one may be a soft wall; the gap is a strain.
    contact: str
    unit: bool  #: Whether all masses are 1, of a chain before a hard wall.

    @classmethod
    def of(cls, line: Line) -> "LineTraits":
        """Return that of a line."""
        if line.at_wall:
            return cls(WALL, line.unit)
        return cls(line.contact.name, False)

    @property
    def at_wall(self) -> bool:
        """Whether the target is a hard, rigid wall."""
        return self.contact == WALL

    @property
    def law(self) -> type[ContactLaw]:
        """The contact law."""
        return Hard if self.at_wall else CONTACT_LAWS[self.contact]


PLAIN = LineTraits(WALL, True)


class LineParameters(NamedTuple):
    """What forces and their effect depend on, where masses differ or bodies are two."""

    bond: Any  #: Of the potential's kernel; tuple of float.
    #: 1/m along x; 0 for a rigid wall that is a particle; of shape (N,).
    inverse: Array
    gap: int  #: Where among the strains the gap is; -1 before a hard wall.
    contact: Any  #: Of the contact law's kernel; tuple of float.

    @classmethod
    def of(cls, line: Line, bond: tuple[float, ...]) -> "LineParameters":
        """Return those of a line, with the parameters of its bonds' kernel."""
        inverse, gap = line.inverse_masses, line.gap
        if line.at_wall:
            inverse, gap = inverse[1:], -1
        return cls(bond, inverse.copy(), gap, line.contact.parameters)


def as_it_is(function: Callable, **_options: Any) -> Callable:
    """Take the place of `LoopCompiler.register` where Python itself runs the loops."""
    return function


class KernelSpec(NamedTuple):
    """What loops are made from, whether they are compiled or run by Python."""

    #: -dU/dr of one strain, ``force(strain, parameters)`` with those of the potential; known to the
    #: compiler.
    force: Callable
    register: Callable  #: Makes a function known to the compiler, or leaves it as it is.
    kind: LineTraits = PLAIN  #: Of the line.


class Reading(NamedTuple):
    """How loops read what they are told of a line: `LineParameters`; of unit masses, the bond's."""

    slice_parameters: (
        Callable  #: ``around(parameters, begin, end)``: those of some particles alone.
    )
    force: Callable  #: ``force(strain, parameters)``: -dU/dr.
    over_mass: (
        Callable  #: ``weighed(number, i, parameters)``: a number over the mass of particle i.
    )


def read_parameters(source: KernelSpec) -> Reading:
    """Return how loops of a kind of line read its parameters."""
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
