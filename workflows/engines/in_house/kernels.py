"""The loops of the stepping engine for one bond potential, compiled where that can be done."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.in_house.coast_loop import build_coast
from chaincor.workflows.engines.in_house.compile import LoopCompiler, ScalarForce, scalar_force
from chaincor.workflows.engines.in_house.contact_search import build_contact_search
from chaincor.workflows.engines.in_house.motion import build_motion
from chaincor.workflows.engines.in_house.stages import (
    array_copy,
    array_drift,
    array_mix,
    array_outside,
    array_stage,
    array_start,
    looped_copy,
    looped_drift,
    looped_mix,
    looped_outside,
    looped_stage,
    looped_start,
)
from chaincor.workflows.engines.schemes import StepScheme, composed_leap, extrapolated_leap

# Loops of so many forces stay loaded: named ones come back from disk, others are compiled again.
_KEPT = 64


@dataclass(frozen=True)
class Kernels:
    """
    The loops for one potential.

    Attributes
    ----------
    advance : callable
        Carries a chain over many steps; see ``motion``.
    coast : callable
        Carries it over coarse steps; see ``coast_loop``.
    parameters : tuple
        Of the potential's kernel.
    compiled : bool
        False where the bond's force cannot be compiled and NumPy steps the chain.
    """

    advance: Callable
    coast: Callable
    parameters: tuple
    compiled: bool


def kernels_for(bond: Potential, scheme: StepScheme) -> Kernels:
    """
    Return the loops for a bond potential, compiled once per process and cached on disk.

    Parameters
    ----------
    bond : Potential
        Where it has a `force_kernel`, that is compiled into the loops. Where it has not, its own
        function is tried, and if that cannot be compiled NumPy steps the chain.
    scheme : StepScheme
        Whether steps are composed or extrapolated.

    Returns
    -------
    Kernels
        The loops.
    """
    return _kernels_for(bond, scheme.extrapolated)


@lru_cache(maxsize=_KEPT)
def _kernels_for(bond: Potential, extrapolated: bool) -> Kernels:
    force = scalar_force(bond)
    if force is not None:
        advance = _compile(force.function, force.keep, extrapolated)
        coast = _compile_coast(force.function, force.keep)
        return Kernels(advance, coast, force.parameters, compiled=True)

    def first_force(strain, _parameters):
        return float(bond.force(np.array([strain]))[0])

    advance = build_motion(
        first_force,
        _array_leap(bond, extrapolated),
        array_outside,
        array_copy,
        build_contact_search,
        lambda function: function,
    )
    coast = build_coast(array_stage(bond), array_drift, array_outside)
    return Kernels(advance, coast, bond.parameters, compiled=False)


def _array_leap(bond: Potential, extrapolated: bool) -> Callable:
    stage = array_stage(bond)
    if extrapolated:
        return extrapolated_leap(array_start(bond), stage, array_copy, array_mix)
    return composed_leap(array_start(bond), stage, array_drift)


@lru_cache(maxsize=_KEPT)
def _compile(function: Callable, keep: bool, extrapolated: bool) -> Callable:
    # Per function, not per bond: toda bonds of any steepness share their loops.
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    register = compiler.register
    kernel = register(function)
    start, stage = register(looped_start(kernel)), register(looped_stage(kernel))
    if extrapolated:
        leap = extrapolated_leap(start, stage, register(looped_copy), register(looped_mix))
    else:
        leap = composed_leap(start, stage, register(looped_drift))
    advance = build_motion(
        kernel,
        register(leap),
        register(looped_outside),
        register(looped_copy),
        build_contact_search,
        register,
    )
    return compiler.compile(advance)


@lru_cache(maxsize=_KEPT)
def _compile_coast(function: Callable, keep: bool) -> Callable:
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    stage = compiler.register(looped_stage(compiler.register(function)))
    outside = compiler.register(looped_outside)
    return compiler.compile(build_coast(stage, compiler.register(looped_drift), outside))
