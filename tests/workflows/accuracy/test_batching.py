"""Test that chains computed in one batch give the results of single runs."""

from dataclasses import fields

import numpy as np
import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.batching import LEAST_TOGETHER, batch_kind, batches
from chaincor.workflows.campaign.work import collide_together
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.reference.batch import runner
from chaincor.workflows.errors import UnfinishedCollisionError

# Computing times may differ.
TIMES = {"seconds", "seconds_total", "replay"}


def scenes(potential, particles, tolerance=1e-6, count=24, fastest=0.4):
    speeds = np.random.default_rng(1).uniform(0.02, fastest, count)
    common = {"potential": potential, "particles": particles, "tolerance": tolerance}
    return [Scene(**common, speed=float(speed), engine="reference") for speed in speeds]


def differing(one, other):
    """Return the fields in which two results differ by a single bit."""
    return [
        f.name
        for f in fields(one)
        if f.name not in TIMES and not np.array_equal(getattr(one, f.name), getattr(other, f.name))
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("potential", "particles", "tolerance"),
    [("lj", 20, 1e-6), ("toda", 7, 1e-6), ("lj", 70, 1e-6), ("toda", 12, 1e-4), ("log", 2, 1e-5)],
)
def test_each_is_what_it_is_alone(potential, particles, tolerance):
    asked = scenes(potential, particles, tolerance)
    found = collide_together(asked)
    assert sum(result is not None for result in found) > 0.3 * len(asked)
    for scene, result in zip(asked, found, strict=True):
        if result is not None:
            assert differing(result, collide(scene)) == []
            assert result.tolerance_met
            assert result.ending in ("proved", "argued")


@pytest.mark.slow
def test_none_depends_on_who_else_is_there():
    asked = scenes("lj", 9, count=40)
    whole = collide_together(asked)
    order = np.random.default_rng(2).permutation(len(asked))
    mixed = collide_together([asked[k] for k in order])
    parts = [result for k in range(0, 40, 7) for result in collide_together(asked[k : k + 7])]
    for k, place in enumerate(order):
        assert differing(whole[place], mixed[k]) == []
        assert differing(whole[place], parts[place]) == []


@pytest.mark.slow
def test_loops_that_come_back_often_change_nothing(monkeypatch):
    asked = scenes("lj", 9)
    whole = collide_together(asked)
    # The compiled loops return to Python after each step, as they do at Ctrl-C.
    monkeypatch.setattr(runner, "steps_at_once", lambda _work: 1)
    for one, other in zip(whole, collide_together(asked), strict=True):
        assert differing(one, other) == []


@pytest.mark.slow
@pytest.mark.parametrize(("particles", "tolerance"), [(20, 1e-6), (100, 1e-5)])
def test_chains_that_may_break_are_followed_to_the_ends_they_have_alone(particles, tolerance):
    # Above 1.67 and 0.74 v*, no chains would be computed in one batch.
    fastest = {20: 1.6, 100: 0.74}[particles]
    broken = scenes("lj", particles, tolerance, fastest=fastest)
    found = collide_together(broken)
    assert {result.ending for result in found if result is not None} == {"proved", "argued"}
    for scene, result in zip(broken, found, strict=True):
        if result is not None:
            assert differing(result, collide(scene)) == []


@pytest.mark.slow
def test_what_does_not_come_out_is_left():
    # Some cubic bonds cross their barrier, and some chains need finer steps.
    speeds = np.random.default_rng(1).uniform(0.05, 0.6, 24).tolist()
    cubic = {"potential": "power", "power_order": 3, "power_c": -1.0, "particles": 12}
    common = cubic | {"engine": "reference", "tolerance": 1e-7}
    asked = [scene for v in speeds if batch_kind(scene := Scene(**common, speed=v)) is not None]
    found = collide_together(asked)
    assert 0 < sum(result is None for result in found) < len(asked)
    for scene, result in zip(asked, found, strict=True):
        if result is not None:
            assert differing(result, collide(scene)) == []


@pytest.mark.slow
def test_what_cannot_be_followed_to_its_end_is_left(monkeypatch):
    asked = scenes("lj", 20, fastest=1.6)
    whole = collide_together(asked)

    def fail(*_):
        raise UnfinishedCollisionError("")

    monkeypatch.setattr(runner, "follow_on", fail)
    argued = [result is not None and result.ending == "argued" for result in whole]
    failed = [result is None for result in collide_together(asked)]
    assert any(argued)
    assert all(missing for missing, was in zip(failed, argued, strict=True) if was)
    assert not all(failed)


@pytest.mark.parametrize(
    "changes",
    [
        {"engine": "lammps"},
        {"scheme": "order8", "timestep": 0.1},
        {"masses": [2.0]},
        {"temperature": 1e-4, "seed": 1},
        {"tolerance": 1e-12},
        {"particles": 1},
        {"particles": 1000},
        {"potential": "harmonic", "velocity": 0.1},
        {"speed": 30.0, "potential": "log"},
        {"speed": 2.5},  # usually falls to pieces
    ],
)
def test_others_are_met_alone(changes):
    scene = Scene(potential="lj", particles=10, engine="reference")
    assert batch_kind(scene) is not None
    if "scheme" in changes:
        scene = scene.without("tolerance")
    assert batch_kind(scene.replace(**changes)) is None


def test_an_output_is_written_alone(tmp_path):
    scene = Scene(particles=10, engine="reference", arrays=tmp_path / "a.npz")
    assert batch_kind(scene) is None


def test_everyone_is_in_one_batch_of_a_kind():
    asked = scenes("lj", 20) + scenes("lj", 21) + scenes("toda", 20) + scenes("lj", 22, count=3)
    asked += scenes("lj", 20, tolerance=1e-4)
    found = [batch.places for batch in batches(asked)]
    assert sorted(place for batch in found for place in batch) == list(range(len(asked)))
    for batch in found:
        assert len({batch_kind(asked[place]) for place in batch}) == 1
        assert len(batch) == 1 or len(batch) >= LEAST_TOGETHER - 8
    alone = [batch for batch in found if len(batch) == 1]
    assert len(alone) == 3, "too few of a kind to be carried out together"
