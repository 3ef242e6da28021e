r"""
Dissipation of a slow long chain, from a computed curve and the lead of the front.

.. math:: n^{2/3} (1 - \eta) = h_r(y) + 2 \beta\, n^{-1/3} + \dots, \qquad
          y = (-1)^r r (r - 1) c\, v_0^{r-2} n^{2/3}

for bonds U = s^2/2 + c s^r + ...; y < 0 if compression softens the bond. There is one curve h_r for
each order r of the bonds, and beta is the lead. The derivation is in
``docs/explanation/slow_chains.md``.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.pair_theory import anharmonic_coefficient
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError

TABLE = Path(__file__).with_name("curves.csv")

# Lead of the front of a harmonic chain at a wall, in bond lengths, from ``harmonic.front_lead``.
FRONT_LEAD = 0.9945645

# Slope h_3(y)/y of the steepest computed fronts, y = 240 and 320, and an assumed bound on the
# change beyond them. The limit y -> infinity is unknown: no fit of
# ``benchmarks.slow_chains.limit`` describes the fronts up to y = 240 and y = 320.
STEEP_LIMIT, STEEP_LIMIT_ERROR = 0.375, 0.001

# Largest relative error if h is interpolated between the points of the table, as measured by
# ``python -m benchmarks.slow_chains.curves --check``.
INTERPOLATION_ERROR = 1e-4


def slow_chain_variable(bond: Potential, particles: int, impact_velocity: float) -> float:
    r"""
    Return y, the only variable on which the limit of slow long chains depends.

    Parameters
    ----------
    bond : Potential
        Bond of stiffness 1 with the lowest anharmonic order r. Harmonic bonds have y = 0.
    particles : int
        Number of particles n.
    impact_velocity : float
        Impact speed v0.

    Returns
    -------
    float
        y, positive if compression stiffens the bond, negative if it softens the bond:
        :math:`|y| = r (r - 1) |c| v_0^{r-2} n^{2/3}`. For r = 3 this is kappa v0 n^(2/3) with
        kappa = -U'''.

    Raises
    ------
    InputError
        If the bond is anharmonic and given by functions or a table, because its lowest order is
        then unknown.
    """
    order = bond.anharmonic_order
    if order is None:
        # The order of functions and tables is unknown. A bond of constant stiffness is harmonic.
        if np.allclose(bond.curvature(np.array([-0.01, 0.01])), bond.stiffness, rtol=1e-6):
            return 0.0
        raise InputError(
            f"The lowest anharmonic order of bond '{bond.name}' is unknown. Give the bond as a "
            "formula."
        )
    coefficient = (-1) ** order * anharmonic_coefficient(bond)
    steepness = order * (order - 1) * coefficient / bond.stiffness
    # Speeds are in units of the speed of sound, because bonds have length 1.
    speed = impact_velocity / math.sqrt(bond.stiffness)
    return float(steepness * speed ** (order - 2) * particles ** (2.0 / 3.0))


@dataclass(frozen=True)
class _Wave:
    """Loss of chains that leave the wall at one wave of the train, for a range of y."""

    variables: Array
    losses: Array
    errors: Array

    def loss(self, variable: Array) -> Array:
        """Interpolate the loss, which is infinite outside the range."""
        from scipy.interpolate import CubicSpline

        inside = (variable >= self.variables[0]) & (variable <= self.variables[-1])
        return np.where(inside, CubicSpline(self.variables, self.losses)(variable), np.inf)


@lru_cache(maxsize=4)
def _waves(order: int) -> tuple[_Wave, ...]:
    """
    Return the waves of the table.

    The loss of a chain is the smallest loss of all waves. As a function of y, the loss has a kink
    if two waves have the same loss.
    """
    table = np.loadtxt(TABLE, delimiter=",", skiprows=1)
    table = table[table[:, 0] == order]
    groups = [table[table[:, 2] == wave] for wave in np.unique(table[:, 2])]
    return tuple(_Wave(g[:, 1], g[:, 4], g[:, 5]) for g in groups if len(g) > 3)


def _within_table(variable: ArrayLike, order: int) -> Array:
    """Return y as an array, or raise ValueError if y is outside the table."""
    wanted = np.asarray(variable, dtype=float)
    waves = _waves(order)
    low = min((wave.variables[0] for wave in waves), default=math.nan)
    high = max((wave.variables[-1] for wave in waves), default=math.nan)
    if not (waves and wanted.min() >= low and wanted.max() <= high):
        raise ValueError(
            f"Order {order}, y from {wanted.min():g} to {wanted.max():g} given. Give order 3 or 4, "
            f"and y within the table ({low:g} to {high:g})."
        )
    return wanted


def limiting_loss(variable: ArrayLike, order: int = 3) -> Array:
    r"""
    Return :math:`h_r(y)`, the limit of :math:`n^{2/3} (1 - \eta)` at fixed y.

    For all orders h_r(0) is 0.56258.

    Parameters
    ----------
    variable : array_like
        y, within the table, which begins at -20.
    order : int
        r: 3 or 4.

    Returns
    -------
    numpy.ndarray
        The smallest of several cubic splines. There is one spline for each wave of the train behind
        the front at which chains can leave the wall. For the error see `limiting_loss_error`.

    Raises
    ------
    ValueError
        If the variable or the order is outside the table.
    """
    wanted = _within_table(variable, order)
    return np.min([wave.loss(wanted) for wave in _waves(order)], axis=0)


def limiting_loss_error(variable: ArrayLike, order: int = 3) -> Array:
    """
    Return the error bar of `limiting_loss`, due to the grid and to interpolation.

    Parameters
    ----------
    variable : array_like
        y, as for `limiting_loss`.
    order : int
        r: 3 or 4.

    Returns
    -------
    numpy.ndarray
        Error of the nearest points of the table, plus the loss times `INTERPOLATION_ERROR`, which
        was measured between the points.
    """
    wanted = _within_table(variable, order)
    waves = _waves(order)
    losses = np.array([wave.loss(wanted) for wave in waves])
    least = losses.argmin(axis=0)
    grids = np.array([np.interp(wanted, wave.variables, wave.errors) for wave in waves])
    chosen = np.take_along_axis(grids, least[None], axis=0)[0]
    return chosen + INTERPOLATION_ERROR * losses.min(axis=0)


def long_chain_slope(bond: Potential) -> float:
    r"""
    Return C of :math:`1 - \eta = C v_0/v^*`, in the limit of long chains, then of low speed.

    :math:`C = 0.375(1)\, \kappa v^*` with :math:`\kappa = -U^{(3)}(1)`: 1.012(3) for lj, 0.951(3)
    for toda at any b, 0.725(2) for log. The errors assume that :math:`h_3(y)/y` has a limit and
    changes by less than 0.001 beyond y = 320.

    Parameters
    ----------
    bond : Potential
        Bond with a cubic term and a unit of speed v*.

    Returns
    -------
    float
        C. Its relative error is `STEEP_LIMIT_ERROR` divided by `STEEP_LIMIT`.

    Raises
    ------
    InputError
        If the bond has another order, because the dissipation is then not linear in the speed.
    """
    if bond.anharmonic_order != 3 or bond.natural_speed is None:
        raise InputError(
            f"bond '{bond.name}' has no cubic term or no speed v*. Give a bond that has both"
        )
    return STEEP_LIMIT * slow_chain_variable(bond, 1, bond.natural_speed)


def slow_chain_dissipation(bond: Potential, particles: int, impact_velocity: float) -> float:
    r"""
    Return 1 - eta of a slow long chain, without a fitted constant.

    Parameters
    ----------
    bond : Potential
        Harmonic bond, or bond of order 3 or 4.
    particles : int
        Number of particles n.
    impact_velocity : float
        Impact speed v0.

    Returns
    -------
    float
        :math:`n^{-2/3} h_r(y) + 2 \beta/n`. The neglected terms decrease faster than 1/n
        at fixed y.
    """
    variable = slow_chain_variable(bond, particles, impact_velocity)
    loss = float(limiting_loss(variable, bond.anharmonic_order or 3))
    return loss * particles ** (-2.0 / 3.0) + 2.0 * FRONT_LEAD / particles
