"""Test the choice of the best of several runs, and its error."""

import math
from dataclasses import replace

import numpy as np
import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.reference_runs import refined, run_reference
from chaincor.workflows.accuracy.refining import Attempt, has_stalled

SCENE = Scene(particles=3, speed=0.4)
# The result at the first of five steps is far off, so that only the last four or three are used.
FOUND = (0.9, 0.701, 0.7002, 0.7, 0.7)
STUCK = (1e-3, 2e-6, 2e-6, 1e-6, 2e-6)


@pytest.fixture(scope="module")
def tries():
    run = run_reference(SCENE.problem, "order8", 0.1)

    def at(restitution):
        speed = SCENE.impact_velocity * math.sqrt(restitution)
        return replace(run, velocities=np.full(SCENE.particles, speed))

    return [Attempt(0.1, e, [at(eta)]) for eta, e in zip(FOUND, STUCK, strict=True)]


def test_where_steps_stop_to_help_the_error_is_how_far_the_last_four_are_apart(tries):
    assert has_stalled(tries)
    found = refined(tries)
    assert found.stalled
    assert found.outcome.eta == pytest.approx(0.7, abs=1e-15)
    assert found.error == pytest.approx(0.001, abs=1e-15)


def test_where_roundings_decide_the_first_of_the_last_three_is_as_good_as_the_finest(tries):
    found = refined(tries, nudged=1e-9)
    assert found.outcome.eta == pytest.approx(0.7002, abs=1e-15)
    assert found.error == pytest.approx(0.0002, abs=1e-15)


def test_while_steps_help_the_best_has_its_own_error(tries):
    assert not has_stalled(tries[:4])
    found = refined(tries[:4])
    assert (found.error, found.stalled) == (1e-6, False)
