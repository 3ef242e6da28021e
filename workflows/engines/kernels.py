"""The loops of the stepping engine for one bond potential, compiled where that can be done."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from types import FunctionType
from typing import Any

import numpy as np
from numba import njit
from numba.core.errors import NumbaError
from numba.extending import register_jitable

from lammps_inputs.potentials import Potential
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

# Multiply-add may round once instead of twice; nothing else may be reordered, so that steps stay
# time-reversible to rounding. NumPy's division does not raise, which lets loops vectorise.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}}


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
    if bond.force_kernel is not None:
        advance, carry = _compile(bond.force_kernel, True)
        return Kernels(advance, carry, bond.parameters, compiled=True)
    scalar_force = _compilable_force(bond)
    if scalar_force is not None:
        advance, carry = _compile(scalar_force, False)
        return Kernels(advance, carry, (0.0, 0.0), compiled=True)

    def first_force(strain, _p, _q):
        return float(bond.force(np.array([strain]))[0])

    advance, carry = _build(
        first_force, array_stage(bond), array_drift, array_outside, count_sign_changes, _as_it_is
    )
    return Kernels(advance, carry, (0.0, 0.0), compiled=False)


def _as_it_is(function):
    return function


def _build(force, stage, drift, outside, count_changes, register):
    """Put the loops together: only `advance` and `carry` are called from Python."""
    return build_motion(
        force,
        stage,
        drift,
        outside,
        partial(build_contact_search, count_changes=count_changes),
        register,
    )


def _own(function: Callable, label: str) -> FunctionType:
    """
    Copy a function under a name that no other potential's loops use.

    Numba's cache on disk is looked up by what a compiled function closes over. A function of a
    module would be pickled by its name, which stays the same when the code behind it changes; a
    copy is pickled by its code. And what is loaded from the cache is linked by symbols made of
    qualified names: with equal names the loops of one potential would call those of another.
    """
    assert isinstance(function, FunctionType)
    copy = FunctionType(
        function.__code__,
        function.__globals__,
        function.__name__,
        function.__defaults__,
        function.__closure__,
    )
    if not function.__qualname__.endswith(label):
        copy.__qualname__ = f"{function.__qualname__}.{label}"
    return copy


@cache
def _compile(force: Callable, keep: bool) -> tuple[Callable, Callable]:
    label = f"{force.__module__}.{force.__qualname__}"

    def register(function):
        return register_jitable(**OPTIONS)(_own(function, label))

    force = register(force)
    loops = _build(
        force,
        register(looped_stage(force)),
        register(looped_drift),
        register(looped_outside),
        register(count_sign_changes),
        register,
    )
    advance, carry = (njit(_own(loop, label), cache=keep, **OPTIONS) for loop in loops)
    return advance, carry


def _compilable_force(bond: Potential) -> Callable | None:
    """Return a user's force as a kernel if it can be compiled and then gives the same numbers."""
    user_force = getattr(bond, "_force", None)
    if not isinstance(user_force, FunctionType):
        return None
    single = njit(user_force, **OPTIONS)
    strains = np.linspace(-0.25, 0.25, 11)
    try:
        compiled = [float(single(strain)) for strain in strains]
    except (NumbaError, TypeError, ValueError):
        return None
    if not np.allclose(compiled, bond.force(strains), rtol=1e-12, atol=1e-15):
        return None

    def kernel(strain, _p, _q):
        return single(strain)

    return kernel
