import mpmath
import numpy as np
import pytest
from mpmath import besselj as j
from mpmath import struveh as h

from chaincor.analysis.modes import mode_frequencies
from chaincor.analysis.slow_chains import harmonic
from chaincor.analysis.slow_chains.curve import FRONT_LEAD
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide


def test_exponentials_are_the_response_of_a_half_infinite_chain():
    times = np.array([0.05, 0.3, 1.0, 1.5, 2.3, 10.0, 300.0, 1e5])
    place = 1.0 + (np.exp(times[:, None] * harmonic._RATES) @ harmonic._WEIGHTS).real
    # R is the integral of J0 + J2. R equals the integral of J0, minus J1, and has a closed form.
    x = [mpmath.mpf(2.0 * time) for time in times]
    exact = [
        float(z * j(0, z) + mpmath.pi * z / 2 * (j(1, z) * h(0, z) - j(0, z) * h(1, z)) - j(1, z))
        for z in x
    ]
    np.testing.assert_allclose(place, exact, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("time", [45.0, 61.0, 70.0, 83.0])
def test_response_and_echo_are_those_of_the_modes_of_a_chain(time):
    n = 30
    omega = mode_frequencies(n)[1:]
    shape = 2.0 / n * np.cos(0.5 * np.pi * np.arange(1, n) / n) ** 2
    exact = time / n + np.sum(shape * np.sin(omega * time) / omega)
    own = 1.0 + float((np.exp(time * harmonic._RATES) @ harmonic._WEIGHTS).real)
    echo = harmonic._EchoOfChain(n)
    back = echo.of(time, [0.0], [1.0])[0] if time > echo.start else 0.0
    # Bessel functions of large order have an error of about 1e-12 times their maximum.
    assert own + back == pytest.approx(exact, abs=1e-10)


def test_collisions_are_those_of_the_exact_modes():
    lengths = [20, 57, 300]
    for n, found in zip(lengths, harmonic.collide_long_chains(lengths), strict=True):
        exact = collide(Scene(potential="harmonic", particles=n, engine="reference"))
        bar = found.restitution_error + exact.restitution_error
        assert found.restitution == pytest.approx(exact.restitution, rel=0.0, abs=bar)
        assert found.restitution_error < 1e-8
        assert found.contacts == exact.contacts
        assert found.particles == n


@pytest.mark.slow
def test_soft_contacts_that_come_soon_after_another_are_seen():
    """Use chains whose last contacts are softer and follow sooner than the steady contacts."""
    found = list(harmonic.collide_long_chains([10_500, 10_600]))
    factors = [(1.0 - chain.restitution) * chain.particles ** (2.0 / 3.0) for chain in found]
    # At this length, the factor scatters by 0.005 with the phase. When contacts were missed, it was
    # 0.797.
    assert factors == pytest.approx([0.642, 0.642], abs=0.02)


def test_chains_of_any_order_go_on_from_one_half_infinite_chain():
    together = list(harmonic.collide_long_chains([300, 100]))
    alone = [next(harmonic.collide_long_chains([n])) for n in (100, 300)]
    assert together == alone


def test_chains_come_as_they_end():
    # The longer chain would take an hour.
    assert next(harmonic.collide_long_chains([10**8, 20])).particles == 20


def test_the_lead_of_the_front_is_the_constant_of_the_curve():
    # Contacts approach the steady state as t^(-3/2): to 1e-5 after t = 2000, and on average closer.
    assert harmonic.front_lead() == pytest.approx(FRONT_LEAD, abs=1e-7)


def test_short_chains_are_refused():
    with pytest.raises(ValueError, match=r"19 particles given\. Give 20 or more"):
        next(harmonic.collide_long_chains([19]))
