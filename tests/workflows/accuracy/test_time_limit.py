"""Test that a collision keeps its time limit and returns the best result so far."""

import contextlib
import time

import numpy as np
import pytest

from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy import by_reference, irregular
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.reference import adaptive
from chaincor.workflows.engines.time_limit import check_time, limited_to, time_limit
from chaincor.workflows.errors import CostError

# Allowed time, and the longest time that a collision then takes. This is 1.2 times the allowed
# time, plus 5 s to compile loops, plus 20 s to complete a task on a busy machine.
ALLOWED, MOST = 3.0, 1.2 * 3.0 + 5.0 + 20.0


def sensitive(place):
    """Return a chain with a heavy particle at this place, which amplifies errors of the steps."""
    masses = [1.0] * 100
    masses[place] = 26.0
    return Scene(potential="log", particles=100, masses=masses, speed=1.03, tolerance=1e-3)


def test_time_that_is_up_is_an_error_by_name():
    check_time()
    with limited_to(1e-6):
        time_limit().end = time.monotonic()
        with pytest.raises(CostError, match="was stopped after about 1e-06 s"):
            check_time()
        assert time_limit().was_short
    assert not time_limit().was_short
    check_time()


@pytest.mark.slow
def test_lammps_answers_within_its_time_and_says_what_is_missed():
    # Without a limit, the collision takes minutes.
    started = time.monotonic()
    found = None
    # On a busy machine, no run may be completed in this time, which is then reported.
    with contextlib.suppress(CostError):
        found = collide(sensitive(95), most_seconds=ALLOWED)
    assert time.monotonic() - started < MOST
    if found is None:
        return
    assert found.tolerance_met is False
    assert "finer steps would take longer than 3 s; allow more time" in found.reason
    exact = collide(sensitive(95).replace(engine="reference"))
    off = abs(found.restitution - exact.restitution)
    assert off <= found.restitution_error + exact.restitution_error


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["lammps", "reference"])
def test_a_collision_without_a_number_by_then_is_stopped(engine):
    started = time.monotonic()
    with pytest.raises(CostError, match="was stopped after about 3 s"):
        collide(sensitive(5).replace(engine=engine), most_seconds=ALLOWED)
    assert time.monotonic() - started < MOST


@pytest.fixture
def time_is_up_after(monkeypatch):
    """Return a function that limits how many runs of a module begin in time, and lists all runs."""

    def limit(module, name, count):
        runs, run = [], getattr(module, name)

        def until_time_is_up(*arguments):
            runs.append(arguments)
            if len(runs) > count:
                time_limit().end = 0.0
            return run(*arguments)

        monkeypatch.setattr(module, name, until_time_is_up)
        return runs

    return limit


def test_past_kinks_too_what_ran_by_then_is_the_answer(time_is_up_after, monkeypatch):
    # The runs are a coarse run, the first attempt at five steps, and the second attempt, which is
    # too late.
    runs = time_is_up_after(irregular, "run_reference", 6)
    monkeypatch.setattr(irregular, "guess_step", lambda *_: 0.1)  # too long for the first attempt
    slack = UserBond(
        lambda s: 0.5 * np.minimum(s, 0.0) ** 2, lambda s: -np.minimum(s, 0.0), kinks=(0.0,)
    )
    scene = Scene(potential=slack, particles=5, velocity=0.1, engine="reference")
    found = collide(scene, tolerance=1e-6, most_seconds=1000.0)
    assert len(runs) == 7
    assert found.tolerance_met is False
    assert "finer steps would take longer than 16.7 min; allow more time" in found.reason
    # ``test_irregular`` has the source of this value.
    assert abs(found.restitution - 0.9024074802364) <= found.restitution_error


def test_adaptive_steps_too_end_with_what_ran_by_then(time_is_up_after, monkeypatch):
    scene = Scene(potential="log", particles=3, speed=2.0, engine="reference")
    exact = collide(scene, tolerance=1e-10)
    assert exact.scheme == "adaptive8"
    # The runs are two of hard spheres, two for comparison with the first attempt, the first
    # attempt, and the second, which is too late.
    runs = time_is_up_after(adaptive, "run", 5)
    # The result is treated as if it had not converged.
    monkeypatch.setattr(by_reference, "_ADAPTIVE_SHARES", (1e3, 1e3))
    found = collide(scene, tolerance=1e-8, most_seconds=1000.0)
    assert len(runs) == 6
    assert found.tolerance_met is False
    assert abs(found.restitution - exact.restitution) <= found.restitution_error
    with pytest.raises(CostError), limited_to(1000.0):
        adaptive.run(scene.problem, 1e-6)
