"""The loops of the stepping engine for one bond potential, compiled where that can be done."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache, partial
from threading import Event

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
from chaincor.workflows.engines.in_house.motion import build_coast, build_motion
from chaincor.workflows.engines.in_house.stages import array_stages, looped_stages
from chaincor.workflows.engines.schemes import StepScheme


@dataclass(frozen=True)
class Kernels:
    """
    The loops for one potential.

    Attributes
    ----------
    advance : callable
        Carries a chain over many steps; see ``motion``.
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


def kernels_for(bond: Potential, scheme: StepScheme) -> Kernels:
    """
    Return the loops for a bond potential, compiled once per process and cached on disk.

    Parameters
    ----------
    bond : Potential
        Where it has a `force_kernel`, that is compiled into the loops. Where it has not, its own
        function is tried, and if that cannot be compiled NumPy steps the chain.
    scheme : StepScheme
        Of what kind steps are.

    Returns
    -------
    Kernels
        The loops.
    """
    return _kernels_for(bond, scheme.build_leap)


@lru_cache(maxsize=KEPT)
def _kernels_for(bond: Potential, build_leap: Callable) -> Kernels:
    force = scalar_force(bond)
    if force is not None:
        advance = _compile(force.function, force.keep, build_leap)
        coast = _compile_coast(force.function, force.keep)
        load_move = partial(_compile_move, force.function, force.keep, build_leap)
        return Kernels(advance, coast, force.parameters, True, load_move)

    def first_force(strain: float, _parameters: tuple[float, ...]) -> float:
        return float(bond.force(np.array([strain]))[0])

    stages = array_stages(bond)
    advance = build_motion(first_force, build_leap(stages), stages, as_it_is)
    return Kernels(advance, build_coast(stages), bond.parameters, compiled=False)


@lru_cache(maxsize=KEPT)
def _compile(function: Callable, keep: Keep, build_leap: Callable) -> Callable:
    # Per function, not per bond: toda bonds of any steepness share their loops.
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    register = compiler.register
    kernel = register(function)
    stages = looped_stages(kernel, register)
    return compiler.compile(build_motion(kernel, register(build_leap(stages)), stages, register))


@lru_cache(maxsize=KEPT)
def _compile_coast(function: Callable, keep: Keep) -> Callable:
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    stages = looped_stages(compiler.register(function), compiler.register)
    return compiler.compile(build_coast(stages))


@lru_cache(maxsize=KEPT)
def _compile_move(function: Callable, keep: Keep, build_leap: Callable) -> Callable:
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    stages = looped_stages(compiler.register(function), compiler.register)
    leap = compiler.register(build_leap(stages))
    return compiler.compile(build_move(leap, stages))
