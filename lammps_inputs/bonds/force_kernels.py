"""
Force kernels: -dU/dr as a function of the strain and the potential's parameters.

They use only arithmetic and NumPy functions that a compiler for scalars also knows, so that the
same text serves arrays in ``potentials`` and compiled loops in the integrators.
"""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple, TypeVar

import numpy as np

from chaincor.lammps_inputs.bonds.exponential import exp_less_one
from chaincor.lammps_inputs.bonds.potential import Array, NoParameters

Strain = TypeVar("Strain", float, Array)


def harmonic_force(strain: Strain, _parameters: NoParameters) -> Strain:
    """Return -s."""
    return -strain


def lj_force(strain: Strain, _parameters: NoParameters) -> Strain:
    """
    Return (r^-13 - r^-7)/6 with the root at r = 1 divided out.

    With w = 1/r, w - 1 = -s w exactly and w^6 - 1 = (w - 1)(1 + w)(1 + w^2 + w^4), so that
    nothing cancels: the force is -s w^8 (1 + w)(1 + w^2 + w^4)/6.
    """
    w = 1.0 / (1.0 + strain)
    w2 = w * w
    w4 = w2 * w2
    return (strain * (1.0 + w) * (1.0 + w2 * (1.0 + w2))) * ((w4 * w4) * (-1.0 / 6.0))


class TodaParameters(NamedTuple):
    """Steepness b."""

    b: float


class MorseParameters(NamedTuple):
    """Inverse width a."""

    a: float


def _exponential_kernels(expm1: Callable) -> tuple[Callable, Callable]:
    """Return the kernels of toda and morse bonds, which close over what they call."""

    def toda_force(strain: Strain, parameters: TodaParameters) -> Strain:
        """Return (exp(-b s) - 1)/b."""
        return expm1(-parameters.b * strain) / parameters.b

    def morse_force(strain: Strain, parameters: MorseParameters) -> Strain:
        """Return e (1 + e)/a with e = exp(-a s) - 1, of which squares stay finite."""
        e = expm1(np.minimum(-parameters.a * strain, 350.0))
        return e * (1.0 + e) / parameters.a

    # Compiled loops are told apart by qualified names.
    toda_force.__qualname__, morse_force.__qualname__ = "toda_force", "morse_force"
    return toda_force, morse_force


toda_force, morse_force = _exponential_kernels(exp_less_one)


def log_force(strain: Strain, _parameters: NoParameters) -> Strain:
    """Return 1/r - 1 = -s/(1 + s)."""
    return -strain / (1.0 + strain)


def log_force_of_log_length(log_length: float, _parameters: NoParameters) -> tuple[float, float]:
    """Return 1/r - 1 and 1/r at ln r, exact at any length: exp(-y) - 1 and exp(-y)."""
    force = np.expm1(-log_length)
    return force, 1.0 + force


class PowerParameters(NamedTuple):
    """Coefficient c of the anharmonic term; its order is the kernel's own."""

    c: float


@cache
def power_force(order: int) -> Callable:
    """
    Return the kernel -s - order c s^(order - 1) for one order.

    To a compiler the order is then a constant, and the power a few multiplications.

    Parameters
    ----------
    order : int
        Order of the anharmonic term, 3 or more.

    Returns
    -------
    callable
        ``kernel(strain, parameters)``.
    """
    exponent = order - 2

    def kernel(strain: Strain, parameters: PowerParameters) -> Strain:
        return -strain * (1.0 + order * parameters.c * strain**exponent)

    # Compiled loops are told apart by qualified names.
    kernel.__qualname__ = f"power{order}_force"
    return kernel
