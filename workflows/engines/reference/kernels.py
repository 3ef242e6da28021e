"""Make the loops of the stepping engine for one potential and one set of traits."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache, partial
from threading import Event
from typing import Any

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.reference.array_stages import array_stages
from chaincor.workflows.engines.reference.compile import (
    KEPT,
    LoopCompiler,
    scalar_force,
)
from chaincor.workflows.engines.reference.line_traits import (
    PLAIN,
    KernelSpec,
    LineTraits,
    unregistered,
)
from chaincor.workflows.engines.reference.motion import build_coarse_steps, build_motion
from chaincor.workflows.engines.reference.stages import looped_stages
from chaincor.workflows.engines.schemes import StepScheme


@dataclass(frozen=True)
class Kernels:
    """Loops for one potential and one set of traits."""

    advance: Callable  #: Loop over many steps, see ``motion``.
    take_coarse_steps: Callable  #: Loop over coarse steps, see ``motion``.
    parameters: tuple[float, ...]  #: Parameters of the potential for its force kernel; NamedTuple.
    #: ``loop(build, *of)`` compiles the function that ``build(source, stages, *of)`` returns; None
    #: if the force of the bond cannot be compiled. NumPy then computes the steps.
    loop: Callable[..., Callable] | None = None
    #: Whether `advance` and `take_coarse_steps` have been called in this process.
    loaded: Event = field(default_factory=Event, compare=False)

    @property
    def compiled(self) -> bool:
        """Whether the loops are compiled."""
        return self.loop is not None


def kernels_for(bond: Potential, scheme: StepScheme, kind: LineTraits = PLAIN) -> Kernels:
    """
    Return the loops for a bond potential, compiled once per process and cached on disk.

    The `force_kernel` of the bond is compiled into the loops. If the bond has no `force_kernel`,
    the function of its user is compiled. If this function cannot be compiled, NumPy steps the
    chain. The loops contain only the features that the traits `kind` require.
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

    made = KernelSpec(first_force, unregistered, kind), array_stages(bond, kind)
    return Kernels(build_motion(*made, build_step), build_coarse_steps(*made), bond.parameters)


@lru_cache(maxsize=3 * KEPT)
def _compile(
    function: Callable, keep: bool, kind: LineTraits, build: Callable, *of: Any
) -> Callable:
    # Loops are cached per function, not per bond; toda bonds of any steepness share one loop. The
    # name contains all traits, because two loops with the same name would overwrite each other on
    # disk.
    name = "" if kind == PLAIN else "".join(f".{trait}" for trait in kind)
    compiler = LoopCompiler.for_force(function, keep, name)
    force = compiler.register(function)
    source = KernelSpec(force, compiler.register, kind)
    return compiler.compile(build(source, looped_stages(source), *of))
