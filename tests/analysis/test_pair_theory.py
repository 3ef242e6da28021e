import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chaincor.analysis.pair_theory import anharmonic_coefficient, pair_interval, pair_interval_slope
from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones, Logarithmic, Morse, Toda
from chaincor.lammps_inputs.bonds.power_bond import Power
from chaincor.lammps_inputs.errors import InputError

BONDS = [LennardJones(), Toda(), Logarithmic(), Power(3, -1.0), Power(4, 1.0), Power(5, -2.0)]
IDS = [f"{b.name}-{b.anharmonic_order}" for b in BONDS]


def integrate_pair(bond, v0):
    """Return the time until s = 0 again, from the equation of motion s'' = -2 U'(s)."""

    def closed(_t, y):
        return y[0]

    closed.terminal, closed.direction = True, 1
    path = solve_ivp(
        lambda _t, y: [y[1], 2.0 * float(bond.force(np.array(y[0])))],
        (0.0, 10.0),
        [0.0, -2.0 * v0],
        method="DOP853",
        rtol=1e-13,
        atol=1e-13 * v0,
        events=closed,
    )
    return path.t[-1]


@pytest.mark.parametrize("bond", BONDS, ids=IDS)
@pytest.mark.parametrize("speed", [1e-8, 0.3, 2.0])
def test_quadrature_agrees_with_the_equation_of_motion(bond, speed):
    v0 = speed * bond.natural_speed
    # DOP853 at 1e-13 over a few steps; the quadrature converges geometrically.
    assert pair_interval(bond, v0) == pytest.approx(integrate_pair(bond, v0), rel=1e-11)


def test_harmonic_pair_is_exact():
    assert pair_interval(Harmonic(), 0.1) == pytest.approx(math.pi / math.sqrt(2), rel=1e-14)


@pytest.mark.parametrize("bond", BONDS, ids=IDS)
def test_slope_is_the_limit_of_the_quadrature(bond):
    order = bond.anharmonic_order - 2
    speed = 0.02 if order > 1 else 1e-3

    def slope(v):
        interval = pair_interval(bond, v * bond.natural_speed)
        return (1.0 - interval * math.sqrt(2.0) / math.pi) / v**order

    # One Richardson step removes the next term, which is proportional to v. Terms in v^2 and
    # rounding errors, 1e-15/v^order, remain.
    limit = 2.0 * slope(0.5 * speed) - slope(speed)
    assert pair_interval_slope(bond) == pytest.approx(limit, rel=20.0 * speed**2)


def test_lj_slope_is_0_8098():
    """Compare with alpha = (4 sqrt(2)/pi) |c| v*, c = -7/2, and with the paper's 0.808."""
    alpha = pair_interval_slope(LennardJones())
    closed_form = 4.0 * math.sqrt(2.0) / math.pi * 3.5 * LennardJones().natural_speed
    assert alpha == pytest.approx(closed_form, rel=1e-8)
    assert round(alpha, 4) == 0.8098


def test_anharmonic_coefficients():
    assert anharmonic_coefficient(LennardJones()) == pytest.approx(-3.5, rel=1e-8)
    assert anharmonic_coefficient(Toda(4.0)) == pytest.approx(-4.0 / 6.0, rel=1e-8)
    assert anharmonic_coefficient(Power(6, 0.7)) == pytest.approx(0.7, rel=1e-8)
    # Steep bonds are included, whose higher terms matter at strains of 1/b.
    assert anharmonic_coefficient(Toda(1000.0)) == pytest.approx(-1000.0 / 6.0, rel=1e-8)
    assert anharmonic_coefficient(Morse(60.0)) == pytest.approx(-30.0, rel=1e-8)


def test_harmonic_bond_has_no_slope():
    with pytest.raises(InputError, match="no speed v"):
        pair_interval_slope(Harmonic())
    with pytest.raises(InputError, match="no anharmonic term"):
        anharmonic_coefficient(Harmonic())
