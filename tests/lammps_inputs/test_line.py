"""Test the line of particles with one missing bond that describes both bodies."""

import math

import numpy as np
import pytest

from chaincor.lammps_inputs.contacts.hard import Hard
from chaincor.lammps_inputs.contacts.power import PowerContact
from chaincor.lammps_inputs.line import Line


def line(target, chain, **fields):
    masses = np.array([*target, *chain], dtype=float)
    return Line(
        masses=masses,
        first=len(target),
        strains=np.zeros(masses.size - 1),
        velocities=np.concatenate((np.zeros(len(target)), np.full(len(chain), -0.1))),
        **fields,
    )


def test_a_wall_is_a_particle_of_inverse_mass_zero():
    wall = line([math.inf], [2.0, 1.0])
    assert wall.rigid
    assert (wall.targets, wall.gap) == (0, 0)
    assert wall.inverse_masses.tolist() == [0.0, 0.5, 1.0]
    assert wall.contact_mass == 2.0
    assert wall.reduced_mass == 3.0
    assert wall.target_masses.size == 0


def test_masses_of_both_bodies_are_listed_from_the_contact_outward():
    both = line([5.0, 4.0, 3.0], [1.0, 2.0])
    assert both.target_masses.tolist() == [3.0, 4.0, 5.0]
    assert both.chain_masses.tolist() == [1.0, 2.0]
    assert (both.targets, both.gap) == (3, 2)
    # Reduced masses: 1/(1/3 + 1/1) for the particles in contact, 1/(1/12 + 1/3) for the bodies.
    assert both.contact_mass == pytest.approx(0.75, rel=1e-15)
    assert both.reduced_mass == pytest.approx(2.4, rel=1e-15)


def test_separation_is_the_relative_velocity_of_the_centres_of_mass():
    both = line([1.0, 3.0], [1.0, 2.0])
    velocities = np.array([-0.1, -0.3, 0.4, 0.1])
    # The centres of mass move at 0.6/3 and -1.0/4.
    assert both.separation(velocities) == pytest.approx(0.45, rel=1e-15)
    assert both.separation(both.velocities) == pytest.approx(-0.1, rel=1e-15)
    wall = line([math.inf], [1.0, 2.0])
    assert wall.separation(velocities[1:]) == pytest.approx(0.2, rel=1e-15)


@pytest.mark.parametrize(
    ("bodies", "soft", "lightest", "mean"),
    [
        # The target's particle of mass 0.1 has no bond and no soft contact.
        (([0.1], [1.0, 3.0]), False, 1.0, 2.0),
        (([0.1], [1.0, 3.0]), True, 0.1, 2.0),
        (([0.1, 0.3], [1.0, 3.0]), False, 0.1, 2.0),
        (([4.0, 8.0], [1.0, 3.0]), False, 1.0, 6.0),
        # A chain of one particle has no bonds either.
        (([4.0, 8.0], [0.5]), False, 4.0, 6.0),
        (([math.inf], [0.5, 1.0]), True, 0.5, 0.75),
    ],
)
def test_the_fastest_particle_and_the_slowest_body(bodies, soft, lightest, mean):
    made = line(*bodies, contact=PowerContact() if soft else Hard())
    assert made.soft is soft
    assert made.lightest == lightest
    assert made.mean_mass == pytest.approx(mean, rel=1e-15)
