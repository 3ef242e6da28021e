"""Test the event-driven simulation of hard spheres against sorted velocities."""

from fractions import Fraction

import pytest

from chaincor.analysis.theory import hard_sphere_limit
from chaincor.workflows.reproduce.figures.contacts_and_restitution import run_hard_spheres


@pytest.mark.parametrize("particles", [1, 2, 3, 8, 21])
def test_counts_are_those_of_sorting(particles):
    _, contacts, exchanges = run_hard_spheres(particles)
    # Each velocity is reversed at the wall once and exchanged with every other velocity once.
    assert contacts == particles
    assert exchanges == particles * (particles - 1) // 2
    assert contacts + exchanges == hard_sphere_limit(particles).events


def test_velocities_are_reversed_in_exact_arithmetic():
    """Require reversed velocities, so that the restitution is 1 and nothing vibrates."""
    assert run_hard_spheres(12, gap=Fraction(3, 11))[0] == [1] * 12
