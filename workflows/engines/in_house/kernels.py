"""The loops of the stepping engine for one potential and kind of line, compiled where it can be."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache, partial
from threading import Event
from typing import Any

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.in_house.blocks.loop import build_move
from chaincor.workflows.engines.in_house.compile import (
    KEPT,
    Keep,
    LoopCompiler,
    ScalarForce,
    as_it_is,
    scalar_force,
)
from chaincor.workflows.engines.in_house.contact import build_contact
from chaincor.workflows.engines.in_house.line_stages import (
    PLAIN,
    Kind,
    array_line_stages,
    looped_line_stages,
)
from chaincor.workflows.engines.in_house.motion import build_coast, build_motion
from chaincor.workflows.engines.schemes import StepScheme


@dataclass(frozen=True)
class Kernels:
    """
    The loops for one potential and kind of line.

    Attributes
    ----------
    advance : callable
        Carries a line over many steps; see ``motion``.
    coast : callable
        Carries it over coarse steps; see ``motion``.
    parameters : NamedTuple
        Of the potential's kernel.
    compiled : bool
        False where the bond's force cannot be compiled and NumPy steps the chain.
    load_move : callable or None
        Returns the loop over a block of a long chain, see ``blocks``; None where not compiled.
    loaded : Event
        Set once `advance` and `coast` have been called in this process.
    """

    advance: Callable
    coast: Callable
    parameters: tuple[float, ...]
    compiled: bool
    load_move: Callable[[], Callable] | None = None
    loaded: Event = field(default_factory=Event, compare=False)


def kernels_for(bond: Potential, scheme: StepScheme, kind: Kind = PLAIN) -> Kernels:
    """
    Return the loops for a bond potential, compiled once per process and cached on disk.

    Parameters
    ----------
    bond : Potential
        Where it has a `force_kernel`, that is compiled into the loops. Where it has not, its own
        function is tried, and if that cannot be compiled NumPy steps the chain.
    scheme : StepScheme
        Of what kind steps are.
    kind : Kind
        Of the line: of what it does not have, its loops know nothing.

    Returns
    -------
    Kernels
        The loops.
    """
    return _kernels_for(bond, scheme.build_leap, kind)


@lru_cache(maxsize=KEPT)
def _kernels_for(bond: Potential, build_leap: Callable, kind: Kind) -> Kernels:
    force = scalar_force(bond)
    if force is not None:
        of = force.function, force.keep, kind
        load_move = partial(_compile_move, *of, build_leap)
        advance, coast = _compile(*of, build_leap), _compile_coast(*of)
        return Kernels(advance, coast, force.parameters, True, load_move)

    def first_force(strain: float, _parameters: tuple[float, ...]) -> float:
        return float(bond.force(np.array([strain]))[0])

    stages = array_line_stages(bond, kind)
    advance = build_motion(first_force, build_leap(stages), stages, as_it_is, kind)
    coast = build_coast(first_force, stages, as_it_is, kind)
    return Kernels(advance, coast, bond.parameters, compiled=False)


def compiler_of(function: Callable, keep: Keep, kind: Kind) -> tuple[LoopCompiler, Callable, Any]:
    """Return the compiler of loops for a force and a kind of line, the force, and its stages."""
    # Per function, not per bond: toda bonds of any steepness share their loops.
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep), _name_of(kind))
    kernel = compiler.register(function)
    return compiler, kernel, looped_line_stages(kernel, compiler.register, kind)


def _name_of(kind: Kind) -> str:
    return "" if kind == PLAIN else f".{kind.contact}"


@lru_cache(maxsize=KEPT)
def _compile(function: Callable, keep: Keep, kind: Kind, build_leap: Callable) -> Callable:
    compiler, kernel, stages = compiler_of(function, keep, kind)
    register = compiler.register
    leap = register(build_leap(stages))
    return compiler.compile(build_motion(kernel, leap, stages, register, kind))


@lru_cache(maxsize=KEPT)
def _compile_coast(function: Callable, keep: Keep, kind: Kind) -> Callable:
    compiler, kernel, stages = compiler_of(function, keep, kind)
    return compiler.compile(build_coast(kernel, stages, compiler.register, kind))


@lru_cache(maxsize=KEPT)
def _compile_move(function: Callable, keep: Keep, kind: Kind, build_leap: Callable) -> Callable:
    compiler, kernel, stages = compiler_of(function, keep, kind)
    leap = compiler.register(build_leap(stages))
    contact = build_contact(kernel, compiler.register, kind)
    return compiler.compile(build_move(leap, stages, contact))
