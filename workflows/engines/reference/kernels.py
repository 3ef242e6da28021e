"""The loops of the stepping engine for one potential and kind of line, compiled where it can be."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache, partial
from threading import Event
from typing import Any

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.reference.compile import (
    KEPT,
    LoopCompiler,
    scalar_force,
)
from chaincor.workflows.engines.reference.line_traits import PLAIN, KernelSpec, LineTraits, as_it_is
from chaincor.workflows.engines.reference.motion import build_coarse_steps, build_motion
from chaincor.workflows.engines.reference.stages import array_stages, looped_stages
from chaincor.workflows.engines.schemes import StepScheme


@dataclass(frozen=True)
class Kernels:
    """The loops for one potential and kind of line."""

    advance: Callable  #: Carries a line over many steps; see ``motion``.
    take_coarse_steps: Callable  #: Carries it over coarse steps; see ``motion``.
    parameters: tuple[float, ...]  #: Of the potential's kernel; NamedTuple.
    #: ``loop(build, *of)``: another, which ``build(source, stages, *of)`` returns uncompiled; None
    #: where the bond's force cannot be compiled and NumPy steps the chain.
    loop: Callable[..., Callable] | None = None
    #: Set once `advance` and `take_coarse_steps` have been called in this process.
    loaded: Event = field(default_factory=Event, compare=False)

    @property
    def compiled(self) -> bool:
        """Whether the loops are compiled."""
        return self.loop is not None


def kernels_for(bond: Potential, scheme: StepScheme, kind: LineTraits = PLAIN) -> Kernels:
    """
    Return the loops for a bond potential, compiled once per process and cached on disk.

    Where the bond has a `force_kernel`, that is compiled into the loops. Where it has not, its own
    function is tried, and if that cannot be compiled NumPy steps the chain. Steps are of the
    scheme's kind; of what the kind of line does not have, its loops know nothing.
    """
    return _kernels_for(bond, scheme.build_step, kind)


@lru_cache(maxsize=KEPT)
def _kernels_for(bond: Potential, build_step: Callable, kind: LineTraits) -> Kernels:
    force = scalar_force(bond)
    if force is not None:
        loop = partial(_compile, force.function, force.keep, kind)
        advance, coarse = loop(build_motion, build_step), loop(build_coarse_steps)
        return Kernels(advance, coarse, force.parameters, loop)

    def first_force(strain: float, _parameters: tuple[float, ...]) -> float:
        return float(bond.force(np.array([strain]))[0])

    made = KernelSpec(first_force, as_it_is, kind), array_stages(bond, kind)
    return Kernels(build_motion(*made, build_step), build_coarse_steps(*made), bond.parameters)


@lru_cache(maxsize=3 * KEPT)
def _compile(
    function: Callable, keep: bool, kind: LineTraits, build: Callable, *of: Any
) -> Callable:
    # Per function, not per bond: toda bonds of any steepness share their loops.
    # All of a kind is in the name: two of one name would write over each other's loops on disk.
    name = "" if kind == PLAIN else "".join(f".{trait}" for trait in kind)
    compiler = LoopCompiler.for_force(function, keep, name)
    force = compiler.register(function)
    source = KernelSpec(force, compiler.register, kind)
    return compiler.compile(build(source, looped_stages(source), *of))
