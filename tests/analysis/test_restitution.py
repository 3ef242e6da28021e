import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chaincor.analysis.restitution import (
    energy_split,
    kinematic_restitution,
    momentum_residual,
    restitution,
)
from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones


def test_restitution_is_the_ratio_of_energies_and_e_that_of_speeds():
    velocities = np.array([[0.5, 0.7], [-1.0, -1.0]])
    assert restitution(velocities, 1.0) == pytest.approx([0.36, 1.0], rel=1e-15)
    assert kinematic_restitution(velocities, 1.0) == pytest.approx([0.6, -1.0], rel=1e-15)


@given(st.integers(2, 30), st.integers(0, 2**32 - 1))
def test_energy_split_adds_up_to_the_energy_of_all_parts(n, seed):
    rng = np.random.default_rng(seed)
    u, v = 0.02 * rng.normal(size=(3, n)), rng.normal(size=(3, n))
    split = energy_split(u, v, LennardJones())
    bonds = np.array([sum(float(LennardJones().energy(s)) for s in np.diff(row)) for row in u])
    # Sums of n terms of size about one have n rounding errors of 1e-16.
    np.testing.assert_allclose(split.total, 0.5 * (v**2).sum(axis=1) + bonds, rtol=1e-13)
    np.testing.assert_allclose(split.translation, v.sum(axis=1) ** 2 / (2 * n), rtol=1e-13)


def test_momentum_balances_the_contacts(harmonic20):
    _, v = harmonic20.state(60.0)
    # There are 17 contacts, located to 1e-14, and 20 velocities near v0.
    assert abs(momentum_residual(v, 0.1, harmonic20.contact_speeds)) < 1e-13
    one_missing = momentum_residual(v, 0.1, harmonic20.contact_speeds[1:])
    assert one_missing == pytest.approx(2.0 / 20.0, abs=1e-13)


def test_restitution_is_one_less_the_share_of_vibration(harmonic20):
    u, v = harmonic20.state(harmonic20.contact_times[-1])
    split = energy_split(u, v, Harmonic())
    assert float(restitution(v, 0.1)) == pytest.approx(
        1.0 - float(split.vibration / split.total), abs=1e-13
    )
    # reference_values.json, n = 20.
    assert float(restitution(v, 0.1)) == pytest.approx(0.86850360724, abs=1e-11)
