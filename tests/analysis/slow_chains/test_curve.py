import numpy as np
import pytest

from chaincor.analysis.slow_chains import curve
from chaincor.analysis.slow_chains.curve import (
    FRONT_LEAD,
    STEEP_LIMIT,
    STEEP_LIMIT_ERROR,
    limiting_loss,
    long_chain_slope,
    slow_chain_dissipation,
    slow_chain_variable,
)
from chaincor.analysis.slow_chains.front import front_loss
from chaincor.analysis.theory import harmonic_dissipation_limit
from chaincor.lammps_inputs.bonds.potentials import (
    Harmonic,
    LennardJones,
    Logarithmic,
    Power,
    Toda,
)
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide


@pytest.mark.parametrize(
    ("bond", "steepness"), [(LennardJones(), 21.0), (Toda(7.0), 7.0), (Logarithmic(), 2.0)]
)
def test_variable_of_cubic_bonds_has_the_third_derivative(bond, steepness):
    # The coefficient of a bond is known to 1e-8.
    assert slow_chain_variable(bond, 1000, 0.01) == pytest.approx(steepness, rel=1e-7)


def test_variable_of_quartic_bonds():
    assert slow_chain_variable(Power(4, 0.5), 1000, 0.1) == pytest.approx(12 * 0.5 * 0.01 * 100)


def test_bonds_that_soften_are_refused(monkeypatch):
    # No named bond softens; a user's may.
    monkeypatch.setattr(curve, "anharmonic_coefficient", lambda bond: 0.5)
    with pytest.raises(InputError, match="'lj' softens by compression"):
        slow_chain_variable(LennardJones(), 100, 0.1)


def test_the_table_is_the_front():
    assert float(limiting_loss(0.0)) == pytest.approx(harmonic_dissipation_limit(), abs=1e-4)
    for order in (3, 4):
        front = front_loss(1.0, order)
        assert float(limiting_loss(1.0, order)) == pytest.approx(front.loss, abs=1e-5)


def test_between_its_points_the_table_is_the_front_too():
    front = front_loss(0.8)
    assert float(limiting_loss(0.8)) == pytest.approx(front.loss, abs=3e-4)


def test_steep_fronts_lose_in_proportion_to_their_speed():
    y = np.array([20.0, 30.0])
    np.testing.assert_allclose(limiting_loss(y) / y, STEEP_LIMIT, atol=STEEP_LIMIT_ERROR)
    # kappa v* is 21 x 0.128489, and the same for all toda bonds.
    assert long_chain_slope(LennardJones()) == pytest.approx(STEEP_LIMIT * 2.698270, rel=1e-5)
    assert long_chain_slope(Toda(3.0)) == pytest.approx(long_chain_slope(Toda(10.0)), rel=1e-6)
    with pytest.raises(InputError, match="expected one with a cubic term"):
        long_chain_slope(Power(4, 0.5))


def test_outside_the_table_nothing_is_said():
    for variable, order in ((31.0, 3), (-0.1, 3), (1.0, 5), (13.0, 4)):
        with pytest.raises(ValueError, match="within the table"):
            limiting_loss(variable, order)


def test_harmonic_chains_have_no_speed():
    losses = [slow_chain_dissipation(Harmonic(), 1000, v) for v in (1e-3, 1.0)]
    assert losses[0] == losses[1]
    expected = 0.01 * harmonic_dissipation_limit() + 0.002 * FRONT_LEAD
    assert losses[0] == pytest.approx(expected, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "bond", [{"potential": "toda"}, {"potential": "power", "power_order": 4, "power_c": 1.0}]
)
def test_chains_are_on_the_curve(bond):
    n, variable = 600, 3.0
    scene = Scene(**bond, particles=n, velocity=1e-3)
    order = scene.bond.anharmonic_order
    velocity = (variable / slow_chain_variable(scene.bond, n, 1.0)) ** (1.0 / (order - 2))
    losses = []
    for length in range(n - 36, n + 37, 12):
        chain = Scene(**bond, particles=length, velocity=velocity, engine="reference")
        losses.append(1.0 - collide(chain, tolerance=1e-5).restitution)
    # What theory leaves out is of order n^(-4/3), with a factor of about 10 (slow_chains.md).
    expected = slow_chain_dissipation(scene.bond, n, velocity)
    assert np.mean(losses) == pytest.approx(expected, abs=12.0 * n ** (-4.0 / 3.0))
    # The term with the front's lead is needed: it is 0.24 of n^(2/3) (1 - eta) here.
    assert abs(np.mean(losses) - expected) < 0.6 * 2.0 * FRONT_LEAD / n
