"""The loops of the stepping engine for one bond potential, compiled where that can be done."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from lammps_inputs.potentials import Potential
from workflows.engines.reference_compile import LoopCompiler, ScalarForce, scalar_force
from workflows.engines.reference_contact import build_contact_search, count_sign_changes
from workflows.engines.reference_motion import build_motion
from workflows.engines.reference_stages import (
    array_drift,
    array_outside,
    array_stage,
    looped_drift,
    looped_outside,
    looped_stage,
)


@dataclass(frozen=True)
class Kernels:
    """
    The loops for one potential.

    Attributes
    ----------
    advance : callable
        Carries a chain over many steps; see ``reference_motion``.
    carry : callable
        Carries it over one step of any size, contacts included.
    parameters : tuple
        The (p, q) of the potential's kernel.
    compiled : bool
        False where the bond's force cannot be compiled and NumPy steps the chain.
    """

    advance: Callable
    carry: Callable
    parameters: tuple
    compiled: bool


@cache
def kernels_for(bond: Potential) -> Kernels:
    """
    Return the loops for a bond potential, compiled once per process and cached on disk.

    Parameters
    ----------
    bond : Potential
        Where it has a `force_kernel`, that is compiled into the loops. Where it has not, its own
        function is tried, and if that cannot be compiled NumPy steps the chain.

    Returns
    -------
    Kernels
        The loops.
    """
    force = scalar_force(bond)
    if force is not None:
        advance, carry = _compile(force.function, force.keep)
        return Kernels(advance, carry, force.parameters, compiled=True)

    def first_force(strain, _p, _q):
        return float(bond.force(np.array([strain]))[0])

    advance, carry = build_motion(
        first_force,
        array_stage(bond),
        array_drift,
        array_outside,
        partial(build_contact_search, count_changes=count_sign_changes),
        lambda function: function,
    )
    return Kernels(advance, carry, (0.0, 0.0), compiled=False)


@cache
def _compile(function: Callable, keep: bool) -> tuple[Callable, Callable]:
    # Per function, not per bond: toda bonds of any steepness share their loops.
    compiler = LoopCompiler.for_force(ScalarForce(function, (), keep))
    register = compiler.register
    kernel = register(function)
    advance, carry = build_motion(
        kernel,
        register(looped_stage(kernel)),
        register(looped_drift),
        register(looped_outside),
        partial(build_contact_search, count_changes=register(count_sign_changes)),
        register,
    )
    return compiler.compile(advance), compiler.compile(carry)
