"""The loops over many chains for one bond potential, compiled."""

from collections.abc import Callable
from functools import lru_cache

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.in_house.compile import (
    KEPT,
    Keep,
    LoopCompiler,
    ScalarForce,
    scalar_force,
)
from chaincor.workflows.engines.in_house.motion import build_coast
from chaincor.workflows.engines.in_house.side_by_side.coasts import build_coasts
from chaincor.workflows.engines.in_house.side_by_side.lanes import build_lane_leap
from chaincor.workflows.engines.in_house.side_by_side.loop import build_carry
from chaincor.workflows.engines.in_house.stages import looped_stages
from chaincor.workflows.engines.schemes import Split, StepScheme


def carry_for(bond: Potential, scheme: StepScheme) -> Callable | None:
    """Return the loop, compiled once and cached on disk; None for forces that do not compile."""
    force = scalar_force(bond)
    if force is None:
        return None
    return _compile(force.function, force.keep, isinstance(scheme, Split))


@lru_cache(maxsize=KEPT)
def _compile(function: Callable, keep: Keep, split: bool) -> Callable:
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    register = compiler.register
    kernel = register(function)
    leap = compiler.register_long(build_lane_leap(kernel, split, register))
    return compiler.compile(build_carry(kernel, leap, register))


def coasts_for(bond: Potential) -> Callable | None:
    """Return the loop over coarse flights in the same way."""
    force = scalar_force(bond)
    return None if force is None else _compile_coasts(force.function, force.keep)


@lru_cache(maxsize=KEPT)
def _compile_coasts(function: Callable, keep: Keep) -> Callable:
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    register = compiler.register
    kernel = register(function)
    coast = register(build_coast(kernel, looped_stages(kernel, register), register))
    return compiler.compile(build_coasts(coast))
