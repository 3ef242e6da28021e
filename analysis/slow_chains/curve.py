r"""
What a slow long chain loses, from the curve of its bonds' order and the lead of its front.

.. math:: n^{2/3} (1 - \eta) = h_r(y) + 2 \beta\, n^{-1/3} + O(n^{-2/3}), \qquad
          y = r (r - 1) |c|\, v_0^{r-2} n^{2/3}

for bonds U = s^2/2 + c s^r + ... that stiffen by compression. Derived in
``docs/explanation/slow_chains.md``.
"""

import math
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.pair_theory import anharmonic_coefficient
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError

TABLE = Path(__file__).with_name("curves.csv")

# By how many bond lengths the front of a pressed harmonic chain is ahead: ``harmonic.front_lead``.
FRONT_LEAD = 0.9945645

# h_3(y)/y for large y: within 0.3715 and 0.3725 from y = 16 to 30, where it still swings.
STEEP_LIMIT, STEEP_LIMIT_ERROR = 0.371, 0.002


def slow_chain_variable(bond: Potential, particles: int, impact_velocity: float) -> float:
    r"""
    Return the one variable of slow long chains.

    Parameters
    ----------
    bond : Potential
        Of lowest anharmonic order r, of stiffness 1; harmonic bonds have y = 0.
    particles : int
        Number of particles n.
    impact_velocity : float
        Impact speed v0.

    Returns
    -------
    float
        :math:`y = r (r - 1) |c| v_0^{r-2} n^{2/3}`; kappa v0 n^(2/3) with kappa = -U''' for r = 3.

    Raises
    ------
    InputError
        If compression softens the bond, whose front does not steepen.
    """
    order = bond.anharmonic_order
    if order is None:
        return 0.0
    coefficient = (-1) ** order * anharmonic_coefficient(bond)
    if coefficient < 0.0:
        raise InputError(
            f"bond '{bond.name}' softens by compression; expected one that stiffens, whose front "
            "steepens"
        )
    steepness = order * (order - 1) * coefficient / bond.stiffness
    # Speeds in units of the sound of the chain, whose bonds have length 1.
    speed = impact_velocity / math.sqrt(bond.stiffness)
    return float(steepness * speed ** (order - 2) * particles ** (2.0 / 3.0))


def limiting_loss(variable: ArrayLike, order: int = 3) -> Array:
    r"""
    Return :math:`h_r(y)`, the limit of :math:`n^{2/3} (1 - \eta)` at fixed y.

    h(0) = 0.56258 for all; h_3 = y C'(y).

    Parameters
    ----------
    variable : array_like
        y, between 0 and the largest of the table (30 for r = 3, 12 for r = 4).
    order : int
        r: 3 or 4.

    Returns
    -------
    numpy.ndarray
        By cubic splines; errors of the table's points are below 3e-3.

    Raises
    ------
    ValueError
        For a variable or order outside the table.
    """
    from scipy.interpolate import CubicSpline

    table = np.loadtxt(TABLE, delimiter=",", skiprows=1)
    points = table[table[:, 0] == order]
    wanted = np.asarray(variable, dtype=float)
    if not len(points) or wanted.min() < 0.0 or wanted.max() > points[-1, 1]:
        raise ValueError(
            f"order {order}, y from {wanted.min():g} to {wanted.max():g}: expected order 3 or 4, "
            "and y within the table"
        )
    return CubicSpline(points[:, 1], points[:, 2])(wanted)


def long_chain_slope(bond: Potential) -> float:
    r"""
    Return C of :math:`1 - \eta = C v_0/v^*` for long chains first, and then low speed.

    :math:`C = 0.371(2)\, \kappa v^*` with :math:`\kappa = -U^{(3)}(1)`: 1.00 for lj, 0.94 for toda
    at any b, 0.72 for log.

    Parameters
    ----------
    bond : Potential
        With a cubic term and v*.

    Returns
    -------
    float
        C; its relative error is `STEEP_LIMIT_ERROR` over `STEEP_LIMIT`.

    Raises
    ------
    InputError
        For bonds of another order, whose dissipation is not linear in the speed.
    """
    if bond.anharmonic_order != 3 or bond.natural_speed is None:
        raise InputError(f"bond '{bond.name}' given; expected one with a cubic term and a speed v*")
    return STEEP_LIMIT * slow_chain_variable(bond, 1, bond.natural_speed)


def slow_chain_dissipation(bond: Potential, particles: int, impact_velocity: float) -> float:
    r"""
    Return 1 - eta of a slow long chain, without a fitted constant.

    Parameters
    ----------
    bond : Potential
        Harmonic, or of order 3 or 4.
    particles : int
        Number of particles n.
    impact_velocity : float
        Impact speed v0.

    Returns
    -------
    float
        :math:`n^{-2/3} h_r(y) + 2 \beta/n`; what is left out is of order 1/n^(4/3) at fixed y.
    """
    variable = slow_chain_variable(bond, particles, impact_velocity)
    loss = float(limiting_loss(variable, bond.anharmonic_order or 3))
    return loss * particles ** (-2.0 / 3.0) + 2.0 * FRONT_LEAD / particles
