"""The loops over many chains for one bond potential, compiled."""

from collections.abc import Callable
from functools import lru_cache

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.in_house.compile import LoopCompiler, ScalarForce, scalar_force
from chaincor.workflows.engines.in_house.kernels import KEPT
from chaincor.workflows.engines.in_house.side_by_side.lanes import build_lane_leap
from chaincor.workflows.engines.in_house.side_by_side.loop import build_carry
from chaincor.workflows.engines.in_house.stages import looped_stages
from chaincor.workflows.engines.schemes import Composed, StepScheme


def carry_for(bond: Potential, scheme: StepScheme) -> Callable | None:
    """Return the loop, compiled once and cached on disk; None for forces that do not compile."""
    force = scalar_force(bond)
    if force is None:
        return None
    return _compile(force.function, force.keep, scheme.build_leap, isinstance(scheme, Composed))


@lru_cache(maxsize=KEPT)
def _compile(function: Callable, keep: bool, build_leap: Callable, composed: bool) -> Callable:
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    register = compiler.register
    kernel = register(function)
    near_leap = register(build_leap(looped_stages(kernel, register)))
    leap = compiler.register_long(build_lane_leap(kernel, composed, register))
    return compiler.compile_allocating(build_carry(kernel, near_leap, leap, register))
