"""Test the forms of the lost energy and the fragments of chains by another method."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chaincor import Scene, collide
from chaincor.analysis.modes import kinetic_mode_energies, mode_frequencies
from chaincor.workflows.engines.fragments import Body
from chaincor.workflows.reproduce import free_flight
from chaincor.workflows.reproduce.figures import mode_spectra
from chaincor.workflows.reproduce.figures.breaking_and_two_restitutions import breaking
from chaincor.workflows.reproduce.free_flight import AVERAGED_OVER, SAMPLED, fly
from chaincor.workflows.reproduce.measurements import Answer, MeasuredPoint

N = 20


def point(potential: str, **speed: float) -> MeasuredPoint:
    scene = Scene(potential=potential, particles=N, engine="reference", tolerance=1e-8, **speed)
    result = collide(scene)
    return MeasuredPoint(scene, None, Answer(result.to_dict(), result.arrays()))


@pytest.fixture(scope="module")
def flights():
    return {u: fly(point("lj", speed=u)) for u in (0.1, 2.0, 6.0)}


@pytest.mark.parametrize("speed", [0.1, 2.0, 6.0])
def test_kinetic_and_bond_energy_are_all_that_is_lost(flights, speed):
    flight = flights[speed]
    lost = 1.0 - flight.point.restitution
    # eta has an error of 1e-8, and the energy of the flight drifts by less than a millionth.
    assert flight.vibration + flight.bonds == pytest.approx(lost, abs=1e-6)
    assert float(flight.kinetic[0]) == pytest.approx(flight.point.restitution, abs=1e-9)
    assert 0.0 <= flight.separation < lost


def test_harmonic_energies_do_not_add_up_where_chains_break(flights):
    """Show that sums of harmonic energies exceed the lost energy if chains break."""
    lost = {u: 1.0 - f.point.restitution for u, f in flights.items()}
    # The cubic part of U is about v0/v* times the quadratic part.
    assert flights[0.1].harmonic == pytest.approx(lost[0.1], rel=0.1)
    assert flights[2.0].harmonic > 1.5 * lost[2.0]


def test_mean_kinetic_energy_is_half_of_a_harmonic_mode():
    flight = fly(point("harmonic", velocity=0.1))
    energies = flight.point.answer.arrays["mode_energies"] / (0.5 * N * 0.1**2)
    duration = AVERAGED_OVER * (N - 1.0)
    omega = mode_frequencies(N)[1:]
    spacing = duration / math.ceil(duration)
    # The absolute mean of cos(2 omega t + phase) over m equally spaced times is at most 1/(m
    # |sin(omega dt)|). Each time is the end of a step and up to 0.3 late, which shifts all phases
    # alike.
    bound = 1.0 / (math.ceil(duration) * np.abs(np.sin(omega * spacing)))
    off = np.abs(2.0 * flight.kinetic[1:] / energies[1:] - 1.0)
    slow = omega < 0.5
    assert np.all(off[slow] < bound[slow] + 0.1)
    assert flight.vibration == pytest.approx(0.5 * float(np.sum(energies[1:])), rel=0.1)


def test_kinetic_modes_add_up_to_the_internal_kinetic_energy():
    rng = np.random.default_rng(3)
    velocities, masses = rng.standard_normal((2, 7)), rng.uniform(0.5, 2.0, 7)
    for m in (None, masses):
        weights = np.ones(7) if m is None else m
        mean = velocities @ weights / np.sum(weights)
        inner = 0.5 * np.sum(weights * (velocities - mean[:, None]) ** 2, axis=1)
        energies = kinetic_mode_energies(velocities, m)
        np.testing.assert_allclose(np.sum(energies[:, 1:], axis=1), inner, rtol=1e-12)
        np.testing.assert_allclose(energies[:, 0], 0.5 * np.sum(weights) * mean**2, rtol=1e-12)


def test_pieces_are_those_of_another_method(flights):
    """Compare with Dormand and Prince's order 8 from the same state, until rounding matters."""
    flight = flights[2.0]
    arrays, bond = flight.point.answer.arrays, flight.point.scene.bond

    def rates(_t, y):
        u, v = y[:N], y[N:]
        force = np.concatenate(([0.0], bond.force(np.diff(u)), [0.0]))
        return np.concatenate((v, force[:-1] - force[1:]))

    start = np.concatenate((arrays["displacements"], arrays["velocities"]))
    times = np.array([t for t in SAMPLED if t <= 2.0]) * (N - 1.0)
    end = solve_ivp(
        rates, (0.0, times[-1] + 1.0), start, "DOP853", times, rtol=1e-11, atol=1e-12
    ).y.T
    counts = [len(Body(y[0], np.diff(y[:N]), y[N:]).pieces(bond).sizes) for y in end]
    assert flight.pieces[0, : len(times)].tolist() == counts
    assert max(counts) > 1


@pytest.mark.slow
def test_slow_chain_is_whole_and_is_said_to_be(flights):
    slow, fast = flights[0.1], flights[2.0]
    assert slow.is_whole
    assert slow.separation == 0.0
    assert not fast.is_whole
    assert "after 40 crossings, from 2 v* on" in breaking((slow, fast))
    assert breaking((slow,)) == "No chain was in pieces."
    assert mode_spectra.figure((slow, fast)).render()["png"]


def test_a_chain_without_the_energy_is_followed_no_further(flights, monkeypatch):
    """Require that the skipped calculation would always have found one piece."""
    monkeypatch.setattr(free_flight, "_pieces", lambda *_: 1 / 0)
    assert fly(flights[0.1].point).pieces.max() == 1
    monkeypatch.undo()
    point = flights[0.1].point
    assert free_flight._break(point, point.answer)[0] == [1] * len(SAMPLED)


def test_speeds_that_break_are_listed_in_ranges_and_undetermined_ones_apart(flights):
    """Call a chain broken only if the two motions agree."""
    template = flights[0.1]

    def flight(speed, *motions):
        at = replace(template.point, scene=template.point.scene.replace(speed=speed))
        pieces = np.array([[count] * len(SAMPLED) for count in motions])
        return replace(template, point=at, pieces=pieces)

    counts = {0.1: (1, 1), 0.5: (1, 2), 0.7: (2, 3), 0.8: (2, 2), 1.0: (1, 1), 2.0: (4, 4)}
    row = tuple(flight(u, *motions) for u, motions in counts.items())
    expected = "between 0.7 and 0.8 v* and from 2 v* on (undetermined at 0.5 v*)"
    assert f"after 1 crossing, {expected};" in breaking(row)
    assert "after 1 crossing, at 0.7 v*;" in breaking((row[0], row[2], row[4]))
