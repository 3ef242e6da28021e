"""The loops of the stepping engine for one potential and kind of line, compiled where it can be."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache, partial
from threading import Event
from typing import Any

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.in_house.blocks.loop import build_move
from chaincor.workflows.engines.in_house.coarse_steps import build_coarse_steps
from chaincor.workflows.engines.in_house.compile import (
    KEPT,
    Keep,
    LoopCompiler,
    ScalarForce,
    as_it_is,
    scalar_force,
)
from chaincor.workflows.engines.in_house.line_kinds import PLAIN, Kind, Source
from chaincor.workflows.engines.in_house.motion import build_motion
from chaincor.workflows.engines.in_house.stages import array_stages, looped_stages
from chaincor.workflows.engines.schemes import StepScheme


@dataclass(frozen=True)
class Kernels:
    """The loops for one potential and kind of line."""

    advance: Callable  #: Carries a line over many steps; see ``motion``.
    take_coarse_steps: Callable  #: Carries it over coarse steps; see ``coarse_steps``.
    parameters: tuple[float, ...]  #: Of the potential's kernel; NamedTuple.
    compiled: bool  #: False where the bond's force cannot be compiled and NumPy steps the chain.
    #: Returns the loop over a block of a long chain, see ``blocks``; None where not compiled.
    load_move: Callable[[], Callable] | None = None
    #: Set once `advance` and `take_coarse_steps` have been called in this process.
    loaded: Event = field(default_factory=Event, compare=False)


def kernels_for(bond: Potential, scheme: StepScheme, kind: Kind = PLAIN) -> Kernels:
    """
    Return the loops for a bond potential, compiled once per process and cached on disk.

    Where the bond has a `force_kernel`, that is compiled into the loops. Where it has not, its own
    function is tried, and if that cannot be compiled NumPy steps the chain. Steps are of the
    scheme's kind; of what the kind of line does not have, its loops know nothing.
    """
    return _kernels_for(bond, scheme.build_step, kind)


@lru_cache(maxsize=KEPT)
def _kernels_for(bond: Potential, build_step: Callable, kind: Kind) -> Kernels:
    force = scalar_force(bond)
    if force is not None:
        of = force.function, force.keep, kind
        load_move = partial(_compile, build_move, *of, build_step)
        advance = _compile(build_motion, *of, build_step)
        take_coarse_steps = _compile(build_coarse_steps, *of)
        return Kernels(advance, take_coarse_steps, force.parameters, True, load_move)

    def first_force(strain: float, _parameters: tuple[float, ...]) -> float:
        return float(bond.force(np.array([strain]))[0])

    made = Source(first_force, as_it_is, kind), array_stages(bond, kind)
    advance = build_motion(*made, build_step(made[1]))
    return Kernels(advance, build_coarse_steps(*made), bond.parameters, compiled=False)


def made_for(
    function: Callable, keep: Keep, kind: Kind, build_step: Callable | None = None
) -> tuple[LoopCompiler, tuple]:
    """
    Return the compiler of loops for a force and a kind of line, and what they are made from.

    That is a `Source`, its `Stages`, and with a scheme's `build_step` its step.
    """
    # Per function, not per bond: toda bonds of any steepness share their loops.
    name = "" if kind == PLAIN else f".{kind.contact}"
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep), name)
    source = Source(compiler.register(function), compiler.register, kind)
    stages = looped_stages(source)
    if build_step is None:
        return compiler, (source, stages)
    return compiler, (source, stages, compiler.register(build_step(stages)))


@lru_cache(maxsize=3 * KEPT)
def _compile(build: Callable, *of: Any) -> Callable:
    compiler, made = made_for(*of)
    return compiler.compile(build(*made))
