import numpy as np
import pytest

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.contact_detection import (
    ContactDetector,
    interpolate_contact,
    reintegrate_contacts,
)
from chaincor.lammps_inputs.bonds.potentials import Harmonic


def detect(collision, times, bond):
    masses = [np.ones(collision.particles)]
    detector = ContactDetector(collision.impact_velocity, masses, bond)
    for time in times:
        detector.feed(ChainState(0, time, *collision.state(time)))
    return detector.result()


@pytest.mark.parametrize("spacing", [0.05, 0.5, 3.0, 20.0])
def test_reintegration_finds_all_contacts_whatever_the_spacing(harmonic20, spacing):
    found = detect(harmonic20, np.arange(-1.0, 80.0, spacing), Harmonic())
    assert found.unresolved == 0
    # DOP853 has a relative tolerance of 1e-12 over tens of steps. A contact time is a position
    # divided by a speed near v0.
    np.testing.assert_allclose(found.times, harmonic20.contact_times, atol=1e-8)
    np.testing.assert_allclose(found.speeds, harmonic20.contact_speeds, rtol=1e-8)
    assert found.worst_miss < 1e-8


@pytest.mark.parametrize(("spacing", "error"), [(0.02, 2e-6), (0.1, 3e-4), (0.5, 3e-2)])
def test_interpolation_has_an_error_of_third_order(harmonic20, spacing, error):
    """Use |jerk| < 2 * 1.15 v0 and closing speeds near v0: the error is (2.3/12) h^3 = 0.2 h^3."""
    found = detect(harmonic20, np.arange(-1.0, 80.0, spacing), None)
    assert found.unresolved == 0
    assert found.times.size == harmonic20.contact_times.size
    assert np.max(np.abs(found.times - harmonic20.contact_times)) < error
    # The change of the momentum is exact.
    np.testing.assert_allclose(found.speeds, harmonic20.contact_speeds, rtol=1e-11)


@pytest.mark.parametrize("ahead", [0.02, 0.45])
def test_interpolation_trusts_the_nearer_frame(harmonic20, ahead):
    """Require the error of the nearer frame, 0.2 * 0.02^3, for frames 0.02 and 0.45 away."""
    contact = harmonic20.contact_times[6]
    found = detect(harmonic20, [contact - ahead, contact + 0.47 - ahead], None)
    # The farther contact adds 0.2 * 0.45^3 = 0.018 with the weight (0.02/0.45)^3 = 9e-5.
    assert abs(found.times[0] - contact) < 4e-6


def test_a_contact_between_two_frames_at_the_wall_is_put_halfway_and_not_trusted():
    detector = ContactDetector(0.1, [np.ones(2)])
    detector.feed(ChainState(0, 1.0, np.zeros(2), np.full(2, -0.1)))
    detector.feed(ChainState(1, 1.5, np.zeros(2), np.full(2, 0.1)))
    found = detector.result()
    assert found.unresolved == 1
    assert found.times.tolist() == [1.25]


def test_frames_too_far_apart_are_not_trusted_without_the_bond(harmonic20):
    found = detect(harmonic20, np.arange(-1.0, 80.0, 5.0), None)
    assert found.unresolved > 0
    assert found.times.size < harmonic20.contact_times.size


def test_frames_written_at_contacts_count_each_contact_once(harmonic20):
    """Frames may be written just before or just after the velocity is reversed."""
    for before_turn in (True, False):
        detector = ContactDetector(0.1, [np.ones(20)], Harmonic())
        detector.add_known(0.0, 0.1)
        for time, speed in zip(harmonic20.contact_times, harmonic20.contact_speeds, strict=True):
            u, v = harmonic20.state(time)
            v[0] = -speed if before_turn and time > 0.0 else speed
            detector.feed(ChainState(0, time, u, v))
        detector.feed(ChainState(0, 60.0, *harmonic20.state(60.0)))
        found = detector.result()
        assert found.unresolved == 0
        np.testing.assert_allclose(found.times, harmonic20.contact_times, atol=1e-8)


def test_wrong_bond_is_noticed(harmonic20):
    found = detect(harmonic20, np.arange(0.0, 80.0, 4.0), _Stiffer())
    assert found.worst_miss > 0.1


class _Stiffer(Harmonic):
    def force(self, strain):
        return -1.5 * np.asarray(strain)


def test_reintegration_follows_only_what_can_reach_the_wall(harmonic500):
    u, v = harmonic500.state(2.0)
    times, speeds = reintegrate_contacts(ChainState(0, 2.0, u, v), 9.0, Harmonic(), [np.ones(500)])
    inside = (harmonic500.contact_times > 2.0) & (harmonic500.contact_times < 9.0)
    np.testing.assert_allclose(times, harmonic500.contact_times[inside], atol=1e-9)
    np.testing.assert_allclose(speeds, harmonic500.contact_speeds[inside], rtol=1e-8)


def test_interpolation_is_off_by_the_third_order_of_the_time(harmonic20):
    # No particle is faster than a particle that has the energy of all particles.
    fastest = harmonic20.impact_velocity * np.sqrt(harmonic20.particles)
    for contact, speed in zip(harmonic20.contact_times, harmonic20.contact_speeds, strict=True):
        for ahead, since in ((0.1, 0.05), (0.02, 0.1)):
            times = contact - ahead, contact + since
            frames = [ChainState(0, time, *harmonic20.state(time)) for time in times]
            found = interpolate_contact(*frames, speed)
            # The mean of two velocities differs from the mean velocity over the time t between them
            # by t^2/12 times the second derivative of the velocity, which is the velocity of
            # particle 2 less that of particle 1.
            mean = 0.5 * (speed - frames[0].gap_velocity), 0.5 * (speed + frames[1].gap_velocity)
            for known, printed, slow in zip((ahead, since), found, mean, strict=True):
                assert abs(printed - known) < known**3 * fastest / (6.0 * slow)


def test_where_particle_1_does_not_move_towards_the_wall_interpolation_knows_no_time():
    away = ChainState(0, 0.0, np.array([0.1, 0.1]), np.array([0.3, 0.3]))
    back = ChainState(1, 0.5, np.array([0.1, 0.1]), np.array([-0.3, -0.3]))
    # The limit is ten times the time between the frames.
    assert interpolate_contact(away, back, 0.2) == (5.0, 5.0)
