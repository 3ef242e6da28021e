import numpy as np
import pytest

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.contact_detection import ContactDetector
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
    # DOP853 at a relative tolerance of 1e-12 over tens of steps; a contact time is a position
    # over a speed of order v0.
    np.testing.assert_allclose(found.times, harmonic20.contact_times, atol=1e-8)
    np.testing.assert_allclose(found.speeds, harmonic20.contact_speeds, rtol=1e-8)
    assert found.worst_miss < 1e-8


@pytest.mark.parametrize(("spacing", "error"), [(0.02, 2e-6), (0.1, 3e-4), (0.5, 3e-2)])
def test_interpolation_has_an_error_of_third_order(harmonic20, spacing, error):
    """|jerk| < 2 * 1.15 v0 and closing speeds near v0: (2.3/12) h^3 = 0.2 h^3 a side."""
    found = detect(harmonic20, np.arange(-1.0, 80.0, spacing), None)
    assert found.unresolved == 0
    assert found.times.size == harmonic20.contact_times.size
    assert np.max(np.abs(found.times - harmonic20.contact_times)) < error
    # The step of the momentum is exact.
    np.testing.assert_allclose(found.speeds, harmonic20.contact_speeds, rtol=1e-11)


@pytest.mark.parametrize("ahead", [0.02, 0.45])
def test_interpolation_trusts_the_nearer_frame(harmonic20, ahead):
    """Frames 0.02 and 0.45 from a contact: the error is that of the nearer, 0.2 * 0.02^3."""
    contact = harmonic20.contact_times[6]
    found = detect(harmonic20, [contact - ahead, contact + 0.47 - ahead], None)
    # And 0.2 * 0.45^3 = 0.018 of the farther one with the weight (0.02/0.45)^3 = 9e-5.
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
    """Either side of the turn may be in the frame."""
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
