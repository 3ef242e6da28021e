"""Test the largest overlap, which the loops of the reference engine follow."""

import pytest

from chaincor import Scene
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.workflows.engines.reference import adaptive, stepping


def by_steps(step, **scene):
    problem = Scene(engine="reference", contact="power", **scene).problem
    return stepping.run(problem, Numerics("event", "order8", step)).tracked["largest_overlap"]


@pytest.mark.parametrize(("stiffness", "exponent"), [(1.0, 1.5), (4.0, 2.0)])
def test_one_particle_turns_where_the_contact_holds_its_energy(stiffness, exponent):
    law = {"contact_stiffness": stiffness, "contact_exponent": exponent}
    found = by_steps(0.02, particles=1, velocity=0.05, **law)
    # The overlap follows from K d^(q + 1)/(q + 1) = v0^2/2. With steps of 1/100 of the contact, the
    # polynomial of order 5 across the turning point has a relative error of about 1e-8.
    energy = 0.5 * 0.05**2
    expected = ((exponent + 1.0) * energy / stiffness) ** (1.0 / (exponent + 1.0))
    assert found == pytest.approx(expected, rel=1e-7)


def test_two_steps_agree_for_a_chain_and_a_target():
    scene = {"potential": "lj", "particles": 5, "target_particles": 3, "velocity": 0.05}
    # The remainder of the polynomial falls as the sixth power of the step.
    assert by_steps(0.2, **scene) == pytest.approx(by_steps(0.1, **scene), rel=1e-5)


def test_beads_turn_where_the_contact_holds_their_energy():
    problem = Scene(potential="hertz", particles=1, velocity=0.05, engine="reference").problem
    found = adaptive.run(problem, 1e-8).tracked["largest_overlap"]
    assert found == pytest.approx((2.5 * 0.5 * 0.05**2) ** 0.4, rel=1e-6)


def test_hard_bodies_do_not_overlap():
    problem = Scene(potential="lj", particles=3, target_particles=2, velocity=0.05).problem
    assert stepping.run(problem, Numerics("event", "order8", 0.1)).tracked == {}
