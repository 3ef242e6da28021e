import itertools
import math

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, quad, trapezoid
from scipy.special import airy

from chaincor.analysis.pair_theory import pair_interval_slope
from chaincor.analysis.theory import (
    HARMONIC_DISSIPATION_COEFFICIENT,
    PAIR_CONTACTS_PER_PARTICLE,
    PAIR_INTERVAL,
    basile_dumont_energies,
    contact_mode_energies,
    hard_sphere_limit,
    harmonic_dissipation_law,
    harmonic_dissipation_limit,
    low_speed_dissipation_slope,
)
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide


def test_coefficient_of_the_law_is_its_integral():
    def integrand(y):
        return math.sin(y**3) ** 2 / y**2 if y else 0.0

    # The average of the tail beyond y = 12 is 1/(2 y) = 0.0417; its oscillation contributes 1e-4
    # times this.
    value = quad(integrand, 0.0, 12.0, limit=3000)[0] + 0.5 / 12.0
    expected = 8.0 / math.pi**2 * math.pi / 24.0 ** (1 / 3) * value
    assert pytest.approx(expected, abs=2e-5) == HARMONIC_DISSIPATION_COEFFICIENT
    assert round(HARMONIC_DISSIPATION_COEFFICIENT, 3) == 0.652  # the paper's value


def test_law_is_the_limit_of_basile_dumont():
    """Allow the sum over j to differ from its integral by n^(-1/3): 1.5 % at 2000, 0.4 % at 2e5."""
    for n, tolerance in ((2_000, 0.02), (200_000, 0.005)):
        share = basile_dumont_energies(n).sum() / (0.5 * n)
        assert share == pytest.approx(float(harmonic_dissipation_law(n)), rel=tolerance)


def test_equal_contacts_are_a_list_of_equal_contacts():
    """Compare the general formula with its geometric sum for equal contacts; f must be whole."""
    n, f, interval, speed = 30, 26, 2.3, 0.115
    expected = contact_mode_energies(n, interval * np.arange(f), np.full(f, speed))
    given = basile_dumont_energies(n, 0.1, interval, f, speed)
    np.testing.assert_allclose(given, expected, rtol=1e-9, atol=1e-16)


def test_default_is_the_chain_of_two():
    n = 50
    default = basile_dumont_energies(n, 2.0)
    explicit = basile_dumont_energies(
        n, 1.0, PAIR_INTERVAL, PAIR_CONTACTS_PER_PARTICLE * n, 2.0 * math.pi / (2 * math.sqrt(2))
    )
    np.testing.assert_allclose(default, explicit, rtol=1e-14)


def test_low_speed_slope_is_that_of_the_formula():
    """Shorten the interval by alpha v, which adds 4 alpha v to the dissipation for large n."""
    n, alpha, v = 400_000, pair_interval_slope(LennardJones()), 0.01
    shortened = basile_dumont_energies(n, interval=PAIR_INTERVAL * (1.0 - alpha * v))
    # The harmonic part, 0.65 n^(-2/3) = 1e-4, is small compared with 4 alpha v = 0.032. The sum
    # over integers j approaches the integral as 1/(alpha v n).
    assert shortened.sum() / (0.5 * n) == pytest.approx(
        low_speed_dissipation_slope(alpha) * v, rel=0.03
    )
    assert low_speed_dissipation_slope(alpha) == pytest.approx(3.239, abs=1e-3)


def test_hard_spheres_by_sorting_velocities():
    n = 9
    velocities = [-1.0] * n
    contacts = events = 0
    while velocities[0] < 0 or any(a > b for a, b in itertools.pairwise(velocities)):
        if velocities[0] < 0:
            velocities[0] = -velocities[0]
            contacts += 1
            events += 1
        for i in range(n - 1):
            if velocities[i] > velocities[i + 1]:
                velocities[i], velocities[i + 1] = velocities[i + 1], velocities[i]
                events += 1
    limit = hard_sphere_limit(n)
    assert (contacts, events) == (limit.contacts, limit.events)
    assert limit.restitution == np.mean(velocities) ** 2 == 1.0


def test_the_limit_of_harmonic_chains_is_that_of_an_airy_front():
    limit = harmonic_dissipation_limit()
    # The reference is a quadrature of the wall's force, 1 - 2 F, up to the end of the contact.
    z = np.linspace(-3.0, 30.0, 330_001)
    tail = 1.0 - cumulative_trapezoid(airy(z)[0], z, initial=0.0)
    tail += (1.0 / 3.0) - np.interp(0.0, z, tail)
    end = np.flatnonzero(tail >= 0.5)[-1]
    width = (1.0 / 4.0) ** (1.0 / 3.0)
    # Per particle and v0, with n = 1 in scaled units, 2 n - J = z0 s + 2 s int F.
    missing = width * (z[end] + 2.0 * trapezoid(tail[end:], z[end:]))
    # The trapezoidal rule with steps of 1e-4 has an error of 1e-8. The root is off by half a step,
    # where the integrand vanishes.
    assert 2.0 * missing == pytest.approx(limit, abs=1e-6)
    assert limit == pytest.approx(0.562584, abs=1e-6)


@pytest.mark.slow
def test_long_harmonic_chains_lose_less_than_the_papers_limit_and_more_than_the_true_one():
    factors = []
    for n in (400, 1600):
        lengths = [round(n * (1.0 + k / 100.0)) for k in range(-6, 7)]
        scenes = [Scene(potential="harmonic", particles=m, engine="reference") for m in lengths]
        losses = [1.0 - collide(scene).restitution for scene in scenes]
        factors.append(np.mean(np.array(losses) * np.array(lengths) ** (2.0 / 3.0)))
    assert 0.75 > factors[0] > factors[1] > harmonic_dissipation_limit()
