"""Test that schemes from the literature have the order of their coefficients."""

import numpy as np
import pytest

from benchmarks.schemes import nystrom
from benchmarks.schemes.candidates import CANDIDATES
from chaincor.lammps_inputs.bonds.potentials import LennardJones

# At these steps, errors are far above rounding and follow the leading order. High orders have fewer
# such steps.
LONGEST = {4: 0.2, 6: 0.4, 8: 0.4, 10: 0.8, 12: 0.75}


def free_flight(candidate, step, time):
    """Return strains and velocities of a free chain of six after a time."""
    rng = np.random.default_rng(3)
    state = (0.0, rng.uniform(-0.02, 0.02, 5), rng.uniform(-0.05, 0.05, 6))
    bond = LennardJones()

    def forces(strain):
        force = np.concatenate(([0.0], bond.force(strain), [0.0]))
        return force[:-1] - force[1:]

    for _ in range(round(time / step)):
        state = candidate.take_step(state, step, forces)
    return np.concatenate(state[1:])


# Errors of order 14 reach rounding where the slope settles, so engines test it.
@pytest.mark.parametrize("name", [name for name in CANDIDATES if name != "extrapolated14"])
def test_observed_order(name):
    candidate = CANDIDATES[name]
    time = 7.2
    exact = free_flight(CANDIDATES["extrapolated14"], time / 72, time)
    fewest = round(time / LONGEST[candidate.order])
    steps = [time / round(fewest * k) for k in (1.0, 1.25, 1.5)]
    errors = [np.linalg.norm(free_flight(candidate, step, time) - exact) for step in steps]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    # A slope below this means a wrong coefficient. Slightly above, the next order still
    # contributes.
    assert candidate.order - 0.7 < slope < candidate.order + 2.0


def test_nystrom_quadrature():
    nodes, positions, velocities = (
        np.array(each) for each in (nystrom.NODES, nystrom.POSITIONS, nystrom.VELOCITIES)
    )
    for power in range(11):
        moment = nodes**power
        assert positions @ moment == pytest.approx(1.0 / ((power + 1) * (power + 2)), abs=1e-15)
        assert velocities @ moment == pytest.approx(1.0 / (power + 1), abs=1e-15)
    # Rows end at their nodes, x(c H) = x + c H v + (c H)^2 f/2 for a constant force.
    for node, row in zip(nodes, nystrom.STAGES, strict=True):
        assert sum(row) == pytest.approx(0.5 * node**2, abs=1e-13)
