"""The loop over many collisions for one bond potential, compiled."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.in_house.compile import (
    KEPT,
    Keep,
    LoopCompiler,
    ScalarForce,
    scalar_force,
)
from chaincor.workflows.engines.in_house.line_stages import Kind, looped_line_stages
from chaincor.workflows.engines.in_house.lines.ensemble_loop import build_carry, is_over
from chaincor.workflows.engines.in_house.lines.lanes import build_lane_leap
from chaincor.workflows.engines.in_house.motion import build_motion
from chaincor.workflows.engines.schemes import Split, StepScheme

# A chain may be warm, and of any masses.
_KIND = Kind("wall", False)


@dataclass(frozen=True)
class EnsembleKernels:
    """
    The loop over many collisions for one potential.

    Attributes
    ----------
    carry : callable
        Carries them to their ends; see ``lines.ensemble_loop``.
    parameters : NamedTuple
        Of the potential's kernel.
    """

    carry: Callable
    parameters: tuple[float, ...]


def ensemble_kernels_for(bond: Potential, scheme: StepScheme) -> EnsembleKernels | None:
    """Return the loop over many collisions; None for forces that cannot be compiled."""
    return _ensemble_kernels_for(bond, scheme.build_leap, isinstance(scheme, Split))


@lru_cache(maxsize=KEPT)
def _ensemble_kernels_for(
    bond: Potential, build_leap: Callable, split: bool
) -> EnsembleKernels | None:
    force = scalar_force(bond)
    if force is None:
        return None
    carry = _compile_carry(force.function, force.keep, build_leap, split)
    return EnsembleKernels(carry, force.parameters)


@lru_cache(maxsize=KEPT)
def _compile_carry(function: Callable, keep: Keep, build_leap: Callable, split: bool) -> Callable:
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    register = compiler.register
    kernel = register(function)
    stages = looped_line_stages(kernel, register, _KIND)
    leap = register(build_leap(stages))
    advance = compiler.register_long(build_motion(kernel, leap, stages, register, _KIND))
    lanes = compiler.register_long(build_lane_leap(kernel, split, register))
    over = compiler.register_long(is_over)
    carry = build_carry(kernel, advance, lanes, over, register)
    return compiler.compile_allocating(carry, threaded=True)
