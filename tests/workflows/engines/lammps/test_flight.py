"""Test the time at which particle 1 crosses the wall within a composed step."""

import numpy as np
import pytest

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.lammps.flight import first_crossing, foreseen_crossing
from chaincor.workflows.engines.reference import modal
from chaincor.workflows.errors import LostAtomsError


def quintic(start, end, step):
    """Return the polynomial through position, velocity and acceleration at both ends."""
    powers = np.arange(6)
    rows, values = [], []
    for moment, (x, v, a) in ((0.0, start), (step, end)):
        rows.append(moment**powers)
        rows.append(powers * moment ** np.maximum(powers - 1, 0))
        rows.append(powers * (powers - 1) * moment ** np.maximum(powers - 2, 0))
        values += [x, v, a]
    return np.polynomial.Polynomial(np.linalg.solve(np.array(rows, dtype=float), values))


def random_ends(rng):
    """Return random states at both ends of a step; the first is off the wall or leaves it."""
    x0 = abs(rng.normal()) * 10.0 ** rng.uniform(-3.0, 1.0)
    v0, a0, v1, a1 = rng.normal(size=4) * [1.0, 4.0, 1.0, 4.0]
    if rng.uniform() < 0.3:
        x0, v0 = 0.0, abs(v0)
    # The end position is near that which these accelerations give.
    x1 = x0 + 0.5 * (v0 + v1) + (a0 - a1) / 12.0 + 0.05 * rng.normal()
    return [x0, v0, a0], [x1, v1, a1]


def test_the_first_of_all_crossings_is_found():
    rng = np.random.default_rng(1)
    crossings = back_in_front = 0
    for _ in range(4000):
        start, end = random_ends(rng)
        found = first_crossing(start, end, 1.0)
        times = np.linspace(0.0, 1.0, 2001)
        x = quintic(start, end, 1.0)(times)
        # The coefficients have rounding errors of about 1e-14, which affect only shallower dips.
        behind = np.flatnonzero(x < -1e-9)
        if len(behind):
            crossings += 1
            back_in_front += end[0] > 0.0
            # A dip shorter than the grid spacing may come before the first grid point behind the
            # wall.
            assert found is not None
            assert found < times[behind[0]] + 1e-3
            assert np.all(x[times < found - 1e-3] >= -1e-9)
        elif x[1:].min() > 1e-3:
            assert found is None
    assert crossings > 1000
    assert back_in_front > 200


def test_a_dip_between_two_departures_is_a_crossing():
    # Particle 1 moves away from the wall at both ends of the step and hits it in between.
    start, end = [0.0, 0.1, -4.0], [0.4, 0.05, -1.0]
    x = quintic(start, end, 1.0)
    assert x(0.1) < 0.0 < end[0]
    zero = min(root.real for root in x.roots() if root.imag == 0.0 and root.real > 1e-9)
    assert first_crossing(start, end, 1.0) == pytest.approx(zero, abs=1e-12)


def test_a_dip_much_shorter_than_the_step():
    # x = (t - 0.4)(t - 0.4002): behind the wall for 2e-4 of the step.
    start, end = [0.4 * 0.4002, -0.8002, 2.0], [0.6 * 0.5998, 1.1998, 2.0]
    # The error is the rounding of the coefficients, 1e-16, divided by the slope of 2e-4.
    assert first_crossing(start, end, 1.0) == pytest.approx(0.4, abs=1e-10)


def test_ends_that_are_no_numbers():
    with pytest.raises(LostAtomsError, match="particle 1 is at"):
        first_crossing([0.1, -1.0, 0.0], [float("nan"), -1.0, 0.0], 0.1)


def test_a_crossing_is_foreseen_only_if_it_is_clear():
    assert foreseen_crossing([0.3, -1.0, 0.0], [0.2, -1.0, 0.0], 0.1) is None
    assert foreseen_crossing([0.15, -1.0, 0.0], [0.05, -1.0, 0.0], 0.1) == pytest.approx(0.05)


@pytest.mark.parametrize("scheme", ["order6", "order8"])
@pytest.mark.parametrize("particles", [17, 87])
def test_contacts_of_coarse_composed_steps(particles, scheme):
    # Several contacts are less than two of these steps apart. The last contact of 87 particles
    # lasts a third of a step.
    scene = Scene(potential="harmonic", particles=particles, velocity=0.1)
    exact = modal.run(scene.problem)
    outcome = lammps.run(scene.problem, Numerics(scheme=scheme, timestep=0.3))
    assert len(outcome.contact_times) == len(exact.contact_times)
    # Order 6 has the largest error, below 0.02 at the last contact of 87 particles. Contacts are
    # 1.4 apart.
    assert np.abs(outcome.contact_times - exact.contact_times).max() < 0.1
