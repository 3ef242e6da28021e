import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.contacts import contact_statistics
from analysis.modes import anharmonic_remainder, mode_amplitudes, mode_energies, mode_frequencies
from analysis.restitution import energy_split, restitution
from analysis.theory import contact_mode_energies
from lammps_inputs.potentials import Harmonic, LennardJones


def naive_energies(u, v, stiffness):
    """Sum over particles mode by mode, in O(n^2)."""
    n = len(u)
    energies = np.zeros(n)
    for j in range(n):
        norm = np.sqrt((1.0 if j == 0 else 2.0) / n)
        shape = norm * np.cos(np.pi * j * (np.arange(1, n + 1) - 0.5) / n)
        omega = 2.0 * np.sqrt(stiffness) * np.sin(np.pi * j / (2.0 * n))
        energies[j] = 0.5 * ((shape @ v) ** 2 + (omega * (shape @ u)) ** 2)
    return energies


@given(st.integers(1, 40), st.integers(0, 2**32 - 1), st.floats(0.1, 10.0))
def test_mode_energies_agree_with_the_sum_over_particles(n, seed, stiffness):
    rng = np.random.default_rng(seed)
    u, v = rng.normal(size=(2, n))
    fast = mode_energies(u, v, stiffness)
    # Both are sums of n products of order one.
    np.testing.assert_allclose(
        fast, naive_energies(u, v, stiffness), atol=1e-13 * n * stiffness + 1e-14
    )


def test_frames_are_transformed_together():
    u, v = np.random.default_rng(1).normal(size=(2, 5, 8))
    together = mode_energies(u, v)
    assert together.shape == (5, 8)
    np.testing.assert_array_equal(together[3], mode_energies(u[3], v[3]))


def test_amplitudes_are_orthonormal_and_frequencies_solve_the_chain():
    n = 7
    shapes = mode_amplitudes(np.eye(n))
    np.testing.assert_allclose(shapes @ shapes.T, np.eye(n), atol=1e-14)
    stiffness_matrix = np.diff(np.eye(n), axis=0).T @ np.diff(np.eye(n), axis=0)
    squares = np.linalg.eigvalsh(stiffness_matrix)
    np.testing.assert_allclose(mode_frequencies(n) ** 2, squares, atol=1e-14)


def test_translation_costs_no_digits():
    """A shift of 1e6 bond lengths leaves energies of order 1e-12 as they are."""
    rng = np.random.default_rng(3)
    strains = 1e-6 * rng.normal(size=63)
    u = np.concatenate(([0.0], np.cumsum(strains)))
    exact = mode_energies(u, np.zeros(64))
    # The shift itself rounds u to 1e-10 (spacing at 1e6), strains to 1e-4 of themselves; a power
    # of two keeps them on a grid of 2^-30, which we choose beforehand.
    grid = np.round(u * 2.0**30) / 2.0**30
    np.testing.assert_array_equal(
        mode_energies(grid + 2.0**20, np.zeros(64)), mode_energies(grid, np.zeros(64))
    )
    assert exact.sum() > 0.0


def test_anharmonic_remainder_completes_the_vibrational_energy():
    rng = np.random.default_rng(4)
    u, v = 0.02 * rng.normal(size=50), 0.1 * rng.normal(size=50)
    split = energy_split(u, v, LennardJones())
    parts = mode_energies(u, v)[1:].sum() + anharmonic_remainder(u, LennardJones())
    assert parts == pytest.approx(float(split.vibration), rel=1e-12)
    assert anharmonic_remainder(u, Harmonic()) == 0.0


def test_harmonic_chain_of_500(harmonic500):
    """Must show 2: modes give the vibrational energy and 1 - eta; contacts as in the paper."""
    u, v = harmonic500.state(harmonic500.contact_times[-1])
    energy = 0.5 * 500 * 0.1**2
    energies = mode_energies(u, v)
    split = energy_split(u, v, Harmonic())
    eta = float(restitution(v, 0.1))
    assert eta == pytest.approx(0.98829311199, abs=1e-11)  # reference_values.json
    assert energies[1:].sum() == pytest.approx(float(split.vibration), rel=1e-11)
    assert energies[1:].sum() / energy == pytest.approx(1.0 - eta, abs=1e-11)
    statistics = contact_statistics(harmonic500.contact_times, harmonic500.contact_speeds, 500, 0.1)
    assert statistics.per_particle == pytest.approx(0.870, abs=5e-4)
    assert statistics.mean_interval == pytest.approx(2.3044, abs=5e-5)
    assert statistics.median_interval == pytest.approx(2.2995, abs=5e-5)
    assert statistics.mean_speed == pytest.approx(1.146, abs=5e-4)
    from_contacts = contact_mode_energies(
        500, harmonic500.contact_times, harmonic500.contact_speeds
    )
    np.testing.assert_allclose(from_contacts, energies[1:], atol=1e-11 * energy)
