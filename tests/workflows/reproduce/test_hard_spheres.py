"""Hard spheres, event by event, against what sorting velocities must give."""

from fractions import Fraction

import pytest

from chaincor.analysis.theory import hard_sphere_limit
from chaincor.workflows.reproduce.hard_spheres import run_hard_spheres


@pytest.mark.parametrize("particles", [1, 2, 3, 8, 21])
def test_counts_are_those_of_sorting(particles):
    run = run_hard_spheres(particles)
    # Every sphere's velocity must turn at the wall once, and pass every other one once.
    assert run.contacts == particles
    assert run.exchanges == particles * (particles - 1) // 2
    assert run.contacts + run.exchanges == hard_sphere_limit(particles).exchanges


def test_restitution_is_one_in_exact_arithmetic():
    run = run_hard_spheres(12, gap=Fraction(3, 11))
    assert run.restitution == 1
    assert run.vibration == 0
