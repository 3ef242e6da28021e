import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chaincor.analysis.caveats import mode_caveats
from chaincor.analysis.contacts import contact_statistics
from chaincor.analysis.modes import (
    anharmonic_remainder,
    indistinct_modes,
    mode_amplitudes,
    mode_energies,
    mode_frequencies,
)
from chaincor.analysis.restitution import energy_split, restitution
from chaincor.analysis.theory import contact_mode_energies
from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones


def naive_energies(u, v, stiffness):
    """Return the mode energies by sums over particles for each mode, in O(n^2)."""
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
    # Both results are sums of n products of size about one.
    np.testing.assert_allclose(
        fast, naive_energies(u, v, stiffness), atol=1e-13 * n * stiffness + 1e-14
    )


@given(st.integers(1, 30), st.integers(0, 2**32 - 1), st.floats(0.1, 10.0))
def test_modes_of_unequal_masses_are_those_of_the_dense_eigenproblem(n, seed, stiffness):
    rng = np.random.default_rng(seed)
    masses = rng.uniform(0.5, 5.0, n)
    u, v = rng.normal(size=(2, n))
    spring = stiffness * np.diff(np.eye(n), axis=0).T @ np.diff(np.eye(n), axis=0)
    root = np.sqrt(masses)
    squares, shapes = np.linalg.eigh(spring / np.outer(root, root))
    squares = np.maximum(squares, 0.0)
    dense = 0.5 * ((shapes.T @ (root * v)) ** 2 + squares * (shapes.T @ (root * u)) ** 2)
    # Eigenvalues have errors of some n eps times the largest eigenvalue, 4 k/min(m). Mode shapes
    # have this error divided by the difference to the next eigenvalue. With random masses,
    # eigenvalues may be close to each other, but sums over all modes are not affected.
    np.testing.assert_allclose(
        mode_frequencies(n, stiffness, masses) ** 2, squares, atol=1e-13 * n * stiffness
    )
    split = energy_split(u, v, Harmonic(), masses)
    fast = mode_energies(u, v, 1.0, masses)
    assert fast.sum() == pytest.approx(float(split.total), rel=1e-11)
    assert fast[0] == pytest.approx(float(split.translation), rel=1e-12)
    gaps = np.diff(squares).min(initial=1.0)
    if gaps > 1e-3:
        # Shapes mix by n eps |K|/gap < 1e-13 n 10/1e-3, and energies have an error of up to 2 |K| n
        # times this.
        np.testing.assert_allclose(mode_energies(u, v, stiffness, masses), dense, atol=1e-7 * n)


def test_equal_masses_are_the_transform_to_the_bit():
    u, v = np.random.default_rng(2).normal(size=(2, 3, 9))
    np.testing.assert_array_equal(mode_energies(u, v, 1.0, np.ones(9)), mode_energies(u, v))
    np.testing.assert_array_equal(mode_frequencies(9, 2.0, np.ones(9)), mode_frequencies(9, 2.0))
    np.testing.assert_array_equal(restitution(v, 0.1, np.ones(9)), restitution(v, 0.1))
    # Twice the mass has the effect of half the stiffness: frequencies change by a factor of
    # sqrt(2), energies by a factor of 2.
    np.testing.assert_allclose(
        mode_energies(u, v, 1.0, np.full(9, 2.0)), 2.0 * mode_energies(u, v, 0.5), rtol=1e-14
    )
    np.testing.assert_allclose(
        mode_frequencies(9, 1.0, np.full(9, 2.0)), mode_frequencies(9, 0.5), rtol=1e-15
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
    """Shift the chain by 1e6 bond lengths, which must not change energies of about 1e-12."""
    rng = np.random.default_rng(3)
    strains = 1e-6 * rng.normal(size=63)
    u = np.concatenate(([0.0], np.cumsum(strains)))
    exact = mode_energies(u, np.zeros(64))
    # A shift by 1e6 would round u to 1e-10, the spacing of numbers there, and strains to a relative
    # 1e-4. Displacements are therefore on a grid of 2^-30, which a shift by a power of two
    # preserves.
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
    """Require that modes give the vibrational energy and 1 - eta, and the paper's contacts."""
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


# Light ends vibrate independently, above all other frequencies. Two light particles at each end
# have several such modes.
LIGHT_ENDS = {
    "one": (np.concatenate(([1.0], np.full(58, 10.0), [1.0])), [(58, 59)]),
    "two": (np.concatenate(([1.0, 1.0], np.full(60, 10.0), [1.0, 1.0])), [(60, 61), (62, 63)]),
}


@pytest.mark.parametrize("ends", LIGHT_ENDS)
def test_energies_do_not_hang_on_the_last_digit_of_a_mass(ends):
    """Require that modes whose frequencies agree to rounding get equal energies."""
    masses, groups = LIGHT_ENDS[ends]
    n = masses.size
    random = np.random.default_rng(1)
    u, v = 0.01 * random.standard_normal((3, n)), 0.1 * random.standard_normal((3, n))
    assert indistinct_modes(mode_frequencies(n, masses=masses)) == groups
    found = mode_energies(u, v, masses=masses)
    for _ in range(20):
        nearby = masses * (1.0 + np.finfo(float).eps * random.integers(-1, 2, n))
        again = mode_energies(u, v, masses=nearby)
        np.testing.assert_allclose(again, found, rtol=0.0, atol=1e-11 * found.sum())
    vibration = energy_split(u, v, Harmonic(), masses).vibration
    np.testing.assert_allclose(found[:, 1:].sum(axis=-1), vibration, rtol=1e-12)


def test_modes_that_are_apart_are_in_no_group():
    for n in (1, 2, 3, 500):
        assert indistinct_modes(mode_frequencies(n)) == []
    assert indistinct_modes(mode_frequencies(200, masses=np.resize([1.0, 3.0], 200))) == []


def test_indistinguishable_modes_are_reported():
    (said,) = mode_caveats(mode_frequencies(60, masses=LIGHT_ENDS["one"][0]))
    assert "modes 58 to 59 agree to rounding, so only the sum of their energies is known" in said
    assert mode_caveats(mode_frequencies(60)) == []
