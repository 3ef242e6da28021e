"""The loops over many chains for one bond potential, compiled."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.in_house.compile import LoopCompiler, ScalarForce, scalar_force
from chaincor.workflows.engines.in_house.kernels import KEPT
from chaincor.workflows.engines.in_house.motion import build_coast, build_motion
from chaincor.workflows.engines.in_house.side_by_side.lanes import build_lane_leap
from chaincor.workflows.engines.in_house.side_by_side.loop import build_carry
from chaincor.workflows.engines.in_house.stages import looped_stages
from chaincor.workflows.engines.schemes import Composed, StepScheme


@dataclass(frozen=True)
class ManyKernels:
    """
    The loops over many chains for one potential.

    Attributes
    ----------
    carry : callable
        Takes steps; see ``loop``.
    coast : callable
        ``coast(ledgers, strains, velocities, steps, counts, clearances, taken, parameters)``:
        coarse steps of each chain, as ``motion.build_coast`` takes them of one; so many were
        `taken`.
    parameters : NamedTuple
        Of the potential's kernel.
    """

    carry: Callable
    coast: Callable
    parameters: tuple[float, ...]


def many_kernels_for(bond: Potential, scheme: StepScheme) -> ManyKernels | None:
    """Return the loops, compiled once and cached on disk; None for forces that do not compile."""
    force = scalar_force(bond)
    if force is None:
        return None
    carry = _compile_carry(
        force.function, force.keep, scheme.build_leap, isinstance(scheme, Composed)
    )
    return ManyKernels(carry, _compile_coast(force.function, force.keep), force.parameters)


@lru_cache(maxsize=KEPT)
def _compile_carry(
    function: Callable, keep: bool, build_leap: Callable, composed: bool
) -> Callable:
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    register = compiler.register
    kernel = register(function)
    stages = looped_stages(kernel, register)
    leap = register(build_leap(stages))
    advance = compiler.register_long(build_motion(kernel, leap, stages, register))
    lanes = compiler.register_long(build_lane_leap(kernel, composed, register))
    return compiler.compile(build_carry(kernel, advance, lanes, register))


@lru_cache(maxsize=KEPT)
def _compile_coast(function: Callable, keep: bool) -> Callable:
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    stages = looped_stages(compiler.register(function), compiler.register)
    return compiler.compile(_build_coasts(compiler.register_long(build_coast(stages))))


def _build_coasts(coast: Callable) -> Callable:
    def coasts(
        ledgers: Any,
        strains: NDArray,
        velocities: NDArray,
        steps: NDArray,
        counts: NDArray,
        clearances: NDArray,
        taken: NDArray,
        parameters: Any,
    ) -> None:
        for s in range(steps.shape[0]):
            glide = (counts[s], steps[s], clearances[s], True, True)
            taken[s] = coast(ledgers[s], (strains[s], velocities[s]), glide, parameters)

    return coasts
