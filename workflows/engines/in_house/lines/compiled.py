"""The loop of two bodies for one bond potential, compiled where that can be done."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.in_house.compile import (
    KEPT,
    Keep,
    LoopCompiler,
    ScalarForce,
    as_it_is,
    scalar_force,
)
from chaincor.workflows.engines.in_house.lines.ensemble_loop import build_carry, is_over
from chaincor.workflows.engines.in_house.lines.lanes import build_lane_leap
from chaincor.workflows.engines.in_house.lines.loop import build_line_motion
from chaincor.workflows.engines.in_house.lines.verlet import array_line_stages, looped_line_stages
from chaincor.workflows.engines.schemes import Split, StepScheme


@dataclass(frozen=True)
class LineKernels:
    """
    The loop for two bodies of one potential.

    Attributes
    ----------
    advance : callable
        Carries them over many steps; see ``lines.loop``.
    parameters : NamedTuple
        Of the potential's kernel.
    """

    advance: Callable
    parameters: tuple[float, ...]


def line_kernels_for(bond: Potential, scheme: StepScheme) -> LineKernels:
    """Return the loop for two bodies, compiled and cached as that of a chain at a wall."""
    return _line_kernels_for(bond, scheme.build_leap)


@lru_cache(maxsize=KEPT)
def _line_kernels_for(bond: Potential, build_leap: Callable) -> LineKernels:
    force = scalar_force(bond)
    if force is not None:
        advance = _compile_line(force.function, force.keep, build_leap)
        return LineKernels(advance, force.parameters)

    def first_force(strain: float, _parameters: tuple[float, ...]) -> float:
        return float(bond.force(np.array([strain]))[0])

    stages = array_line_stages(bond)
    advance = build_line_motion(first_force, build_leap(stages), stages, as_it_is)
    return LineKernels(advance, bond.parameters)


@lru_cache(maxsize=KEPT)
def _compile_line(function: Callable, keep: Keep, build_leap: Callable) -> Callable:
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    register = compiler.register
    kernel = register(function)
    stages = looped_line_stages(kernel, register)
    leap = register(build_leap(stages))
    return compiler.compile(build_line_motion(kernel, leap, stages, register))


def ensemble_kernels_for(bond: Potential, scheme: StepScheme) -> LineKernels | None:
    """Return the loop over many collisions; None for forces that cannot be compiled."""
    return _ensemble_kernels_for(bond, scheme.build_leap, isinstance(scheme, Split))


@lru_cache(maxsize=KEPT)
def _ensemble_kernels_for(bond: Potential, build_leap: Callable, split: bool) -> LineKernels | None:
    force = scalar_force(bond)
    if force is None:
        return None
    carry = _compile_carry(force.function, force.keep, build_leap, split)
    return LineKernels(carry, force.parameters)


@lru_cache(maxsize=KEPT)
def _compile_carry(function: Callable, keep: Keep, build_leap: Callable, split: bool) -> Callable:
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    register = compiler.register
    kernel = register(function)
    stages = looped_line_stages(kernel, register)
    leap = register(build_leap(stages))
    advance = compiler.register_long(build_line_motion(kernel, leap, stages, register))
    lanes = compiler.register_long(build_lane_leap(kernel, split, register))
    over = compiler.register_long(is_over)
    carry = build_carry(kernel, advance, lanes, over, register)
    return compiler.compile_allocating(carry, threaded=True)
