"""Traits of the bodies for which loops are compiled, and parameters of the loops."""

from collections.abc import Callable
from typing import Any, NamedTuple

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.contacts.contact_law import ContactLaw
from chaincor.lammps_inputs.contacts.contact_laws import CONTACT_LAWS
from chaincor.lammps_inputs.contacts.hard import Hard
from chaincor.lammps_inputs.line import Line

WALL = "wall"


class LineTraits(NamedTuple):
    """Traits of the bodies for which loops are compiled; unused features are compiled out."""

    #: ``wall`` means a hard, rigid wall. Such a wall does not count as a particle, and the gap is
    #: the position of particle 1. Any other value is the contact law of two bodies, one of which
    #: may be a soft wall; the gap is then one of the strains.
    contact: str
    unit: bool  #: Whether all masses of a chain at a hard wall are 1.

    @classmethod
    def of(cls, line: Line) -> "LineTraits":
        """Return the traits of the bodies in a line."""
        if line.at_wall:
            return cls(WALL, line.unit)
        return cls(line.contact.name, False)

    @property
    def at_wall(self) -> bool:
        """Whether the target is a hard, rigid wall."""
        return self.contact == WALL

    @property
    def law(self) -> type[ContactLaw]:
        """Contact law of the bodies."""
        return Hard if self.at_wall else CONTACT_LAWS[self.contact]


PLAIN = LineTraits(WALL, True)


class LineParameters(NamedTuple):
    """Parameters of forces and masses if masses are unequal or both bodies are particles."""

    bond: Any  #: Parameters of the potential for its force kernel; tuple of float.
    #: Inverse masses along x, of shape (N,); 0 for a rigid wall that counts as a particle.
    inverse: Array
    gap: int  #: Index of the gap among the strains; -1 for a hard wall.
    contact: Any  #: Parameters of the contact law for its force kernel; tuple of float.

    @classmethod
    def of(cls, line: Line, bond: tuple[float, ...]) -> "LineParameters":
        """Return the parameters for a line; `bond` contains the parameters of its bonds."""
        inverse, gap = line.inverse_masses, line.gap
        if line.at_wall:
            inverse, gap = inverse[1:], -1
        return cls(bond, inverse.copy(), gap, line.contact.parameters)


def unregistered(function: Callable, **_options: Any) -> Callable:
    """Return a function unchanged; replaces `LoopCompiler.register` if loops are not compiled."""
    return function


class KernelSpec(NamedTuple):
    """Functions and traits from which loops are made, to be compiled or run by Python."""

    #: Force -dU/dr at one strain, ``force(strain, parameters)`` with the parameters of the
    #: potential; registered with the compiler.
    force: Callable
    #: Function that registers a function with the compiler, or returns it unchanged.
    register: Callable
    kind: LineTraits = PLAIN  #: Traits of the bodies.


class Reading(NamedTuple):
    """Functions that read `LineParameters`, or the parameters of the bond if all masses are 1."""

    #: ``slice_parameters(parameters, begin, end)``: parameters of some of the particles.
    slice_parameters: Callable
    force: Callable  #: ``force(strain, parameters)``: -dU/dr.
    #: ``over_mass(number, i, parameters)``: a number divided by the mass of particle i.
    over_mass: Callable


def read_parameters(source: KernelSpec) -> Reading:
    """Return the functions with which loops read their parameters."""
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
    def slice_line(parameters: LineParameters, begin: int, end: int) -> LineParameters:
        bond, inverse, gap, contact = parameters
        return LineParameters(bond, inverse[begin:end], gap - begin, contact)

    @register
    def force(strain: float, parameters: LineParameters) -> float:
        return of_bond(strain, parameters.bond)

    @register
    def over_line_mass(number: float, i: int, parameters: LineParameters) -> float:
        return number * parameters.inverse[i]

    return Reading(slice_line, force, over_line_mass)
