"""Test that results of long chains on several cores do not depend on the division into blocks."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from chaincor import collide
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.pool import ProcessPool
from chaincor.workflows.engines import time_limit
from chaincor.workflows.engines.reference import bookkeeping, moving, stepping
from chaincor.workflows.engines.reference.blocks import running
from chaincor.workflows.engines.reference.loops.processes import cores
from chaincor.workflows.errors import TimestepError
from tests.interrupting import interrupted

LJ = Scene(potential="lj", particles=260, speed=0.4)
# In the last chain, bonds break, and runs with other steps help to find the end.
RUNS = {
    "composed": (LJ, "order8", 0.3),
    "verlet": (LJ.replace(particles=150), "verlet", 0.05),
    "extrapolated": (LJ.replace(potential="toda", particles=261), "extrapolated14", 0.5),
    "log": (LJ.replace(potential="log", particles=150), "order4", 0.1),
    "breaking": (LJ.replace(particles=130, speed=1.0), "extrapolated12", 0.3),
}


@pytest.fixture
def in_blocks(monkeypatch):
    """Return a function that sets the number of blocks, even for short chains."""

    def cut(count, substeps=4, aligned=1):
        monkeypatch.setattr(moving, "cores", lambda: count)
        monkeypatch.setattr(running, "LEAST_ACTIVE", 80)
        monkeypatch.setattr(running, "LEAST_MARGINS", 1)
        monkeypatch.setattr(running, "SUBSTEPS", substeps)
        monkeypatch.setattr(running, "ALIGNED", aligned)
        # The loop over the whole chain returns early, so that loops over blocks replace it.
        monkeypatch.setattr(time_limit, "WORK_AT_ONCE", 30_000)

    return cut


@pytest.fixture
def moved(monkeypatch):
    """Return a list with the number of blocks at each synchronization."""
    counts = []
    cut = running._Blocks._cut

    def noted(blocks, substeps):
        found = cut(blocks, substeps)
        counts.append(len(found))
        return found

    monkeypatch.setattr(running._Blocks, "_cut", noted)
    return counts


def assert_same(one, other):
    for name in ("contact_times", "contact_speeds", "velocities", "displacements"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    for name in ("duration", "ending", "bond_min", "bond_max", "force_evaluations"):
        assert getattr(one, name) == getattr(other, name), name


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "scheme", "step"), RUNS.values(), ids=RUNS.keys())
def test_no_bit_depends_on_cores(scene, scheme, step, in_blocks, moved):
    numerics = Numerics(scheme=scheme, timestep=step)
    in_blocks(1)
    whole = stepping.run(scene.problem, numerics)
    assert moved == []
    for count, substeps, aligned in ((2, 3, 1), (3, 2, 7), (3, 5, 64)):
        in_blocks(count, substeps, aligned)
        assert_same(stepping.run(scene.problem, numerics), whole)
        assert len(moved) > 20
        assert max(moved) > 1
        moved.clear()


def test_a_result_is_the_same(in_blocks, moved):
    scene = LJ.replace(engine="reference")
    in_blocks(1)
    whole = collide(scene, tolerance=1e-6)
    in_blocks(3)
    found = collide(scene, tolerance=1e-6)
    assert max(moved) > 1
    assert found.restitution == whole.restitution
    assert found.restitution_error == whole.restitution_error
    assert np.array_equal(found.mode_energies, whole.mode_energies)


def test_snapshots_are_the_same(in_blocks, moved):
    numerics = Numerics(scheme="order6", timestep=0.2)
    in_blocks(1)
    whole = stepping.run(LJ.problem, numerics, frame_interval=20.0)
    in_blocks(2)
    found = stepping.run(LJ.problem, numerics, frame_interval=20.0)
    assert moved
    assert_same(found, whole)
    assert np.array_equal(found.frames.displacements, whole.frames.displacements)


def test_what_is_not_foreseen_is_left_to_the_loop_over_the_whole(in_blocks, moved, monkeypatch):
    numerics = Numerics(scheme="order4", timestep=0.15)
    in_blocks(1)
    whole = stepping.run(LJ.problem, numerics)
    in_blocks(2)
    go_ahead, calls = running._Head.go_ahead, []

    def crowded_now_and_then(head, state, target_steps):
        status, substeps = go_ahead(head, state, target_steps)
        calls.append(status)
        return (bookkeeping.CROWDED if len(calls) % 3 == 0 else status), substeps

    monkeypatch.setattr(running._Head, "go_ahead", crowded_now_and_then)
    assert_same(stepping.run(LJ.problem, numerics), whole)
    assert len(calls) > len(moved) > 0


def test_bonds_that_fail_are_named_alike(in_blocks, moved, monkeypatch):
    numerics = Numerics(scheme="order6", timestep=0.2)
    in_blocks(1)
    longest = stepping.run(LJ.problem, numerics).bond_max - 1.0
    monkeypatch.setattr(moving, "allowed_strains", lambda bond: (-1.0, 0.999 * longest))
    # The start of the original problem is cached with the earlier allowed strains.
    problem = replace(LJ.problem)
    reasons = []
    for count in (1, 2):
        in_blocks(count)
        with pytest.raises(TimestepError) as failure:
            stepping.run(problem, numerics)
        reasons.append(str(failure.value))
    assert reasons[0] == reasons[1]
    assert len(moved) > 10


def test_cores_are_not_taken_twice(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    most = cores()
    with ThreadPoolExecutor(1) as threads, ProcessPool(1) as processes:
        assert threads.submit(cores).result() == processes.submit(cores).result() == 1
    for wanted, found in (("1", 1), ("1000", most), ("0", 1), ("", most), ("2,1", most)):
        monkeypatch.setenv("OMP_NUM_THREADS", wanted)
        assert cores() == found, wanted


SESSION = """
import signal, threading
signal.signal(signal.SIGINT, signal.default_int_handler)
from chaincor import Scene, collide
from chaincor.workflows.engines.reference import moving
moving.cores = lambda: 3
scene = Scene(particles=20000, engine="reference", scheme="order8", timestep=0.1)
print("BEGINS", flush=True)
try:
    collide(scene)
except KeyboardInterrupt:
    print(threading.active_count())
"""


@pytest.mark.slow
def test_it_can_be_stopped(tmp_path):
    # At this time, sound has travelled far enough for blocks. No helper thread may outlive the
    # collision.
    assert interrupted(tmp_path, SESSION, 6.0) == "1\n"
