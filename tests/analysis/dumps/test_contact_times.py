import numpy as np

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.contact_detection import interpolate_contact, reintegrate_contacts
from chaincor.lammps_inputs.bonds.potentials import Harmonic


def test_reintegration_follows_only_what_can_reach_the_wall(harmonic500):
    u, v = harmonic500.state(2.0)
    times, speeds = reintegrate_contacts(ChainState(0, 2.0, u, v), 9.0, Harmonic(), [np.ones(500)])
    inside = (harmonic500.contact_times > 2.0) & (harmonic500.contact_times < 9.0)
    np.testing.assert_allclose(times, harmonic500.contact_times[inside], atol=1e-9)
    np.testing.assert_allclose(speeds, harmonic500.contact_speeds[inside], rtol=1e-8)


def test_interpolation_is_off_by_the_third_order_of_the_time(harmonic20):
    # No particle is faster than if it had the energy of all.
    fastest = harmonic20.impact_velocity * np.sqrt(harmonic20.particles)
    for contact, speed in zip(harmonic20.contact_times, harmonic20.contact_speeds, strict=True):
        for ahead, since in ((0.1, 0.05), (0.02, 0.1)):
            times = contact - ahead, contact + since
            frames = [ChainState(0, time, *harmonic20.state(time)) for time in times]
            found = interpolate_contact(*frames, speed)
            # The mean of two velocities is off from that over the time t between them by t^2/12
            # times their second derivative: the velocity of particle 2 less that of particle 1.
            mean = 0.5 * (speed - frames[0].opening), 0.5 * (speed + frames[1].opening)
            for known, told, slow in zip((ahead, since), found, mean, strict=True):
                assert abs(told - known) < known**3 * fastest / (6.0 * slow)


def test_where_particle_1_does_not_move_towards_the_wall_interpolation_knows_no_time():
    away = ChainState(0, 0.0, np.array([0.1, 0.1]), np.array([0.3, 0.3]))
    back = ChainState(1, 0.5, np.array([0.1, 0.1]), np.array([-0.3, -0.3]))
    # Ten times the time between the frames.
    assert interpolate_contact(away, back, 0.2) == (5.0, 5.0)
