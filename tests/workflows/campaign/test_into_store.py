"""Test that sweeps compute only missing results, whatever process dies."""

import itertools
import os
import signal
import threading
from concurrent.futures import Future, ThreadPoolExecutor

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.plan import plan
from chaincor.workflows.campaign import carry_out, into_store
from chaincor.workflows.campaign.forecast import Forecast
from chaincor.workflows.campaign.into_store import IntoStore, collide_into_store
from chaincor.workflows.campaign.tasks import requests_of, tasks_of, turn
from chaincor.workflows.campaign.work import collide_scenes, collide_to_rows
from chaincor.workflows.collision import collide
from chaincor.workflows.errors import (
    CrossingError,
    MissingLibraryError,
    SchedulerError,
    StoreError,
    WorkerDiedError,
)
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.row import Row
from tests.waiting import HANGS
from tests.workflows.campaign import kills

SCENES = [Scene(potential=p, particles=n, speed=0.4) for p in ("lj", "toda") for n in (5, 9, 20)]
BROKEN = Scene(potential="lj", particles=7, speed=0.4)


@pytest.fixture
def counted(monkeypatch, make_attempt):
    """Replace collisions by an instant function, and list its calls."""
    asked = []

    def instant(scenes, **options):
        if len(scenes) > 1:
            return [None] * len(scenes)
        asked.extend(scenes)
        if scenes == [BROKEN]:
            return [Row.of(CrossingError("crossed")).of_scene(BROKEN)]
        return [make_attempt(scenes[0]).row.of_scene(scenes[0])]

    monkeypatch.setattr(into_store, "collide_to_rows", instant)
    return asked


def run_in_threads(store, scenes, **wishes):
    with ThreadPoolExecutor(2) as threads:
        return IntoStore(store, scenes, **wishes).run(threads, in_flight=4)


# ---- only what is missing -----------------------------------------------------------------------


def test_nothing_is_computed_twice(store, counted):
    first = run_in_threads(store, SCENES + SCENES)
    again = run_in_threads(store, SCENES)
    assert (first.computed, again.computed, again.found) == (6, 0, 6)
    assert len(counted) == len(store) == 6


def test_unless_it_is_asked_for(store, counted):
    run_in_threads(store, SCENES)
    run_in_threads(store, SCENES, recompute=True)
    assert len(counted) == 12
    assert {store.get(scene).columns["tries"] for scene in SCENES} == {2}


def test_of_several_tolerances_the_tightest_is_computed(store, counted):
    run_in_threads(store, [BROKEN.replace(particles=5, tolerance=t) for t in (1e-4, 1e-8, 1e-6)])
    assert [scene.tolerance for scene in counted] == [1e-8]


def test_missing_arrays_are_computed_for_the_result_that_is_there(store, counted):
    tight = SCENES[0].replace(tolerance=1e-9)
    run_in_threads(store, [tight])
    run_in_threads(store, [SCENES[0]], arrays=True)
    assert [scene.tolerance for scene in counted] == [1e-9, 1e-9]
    assert store.get(tight, arrays=True) is not None


def test_a_failure_that_stands_is_tried_again_only_on_request(store, counted):
    first = run_in_threads(store, [BROKEN, SCENES[0]])
    assert (first.computed, first.failed) == (1, 1)
    again = IntoStore(store, [BROKEN, SCENES[0]])
    assert (again.todo, again.tally.found, again.tally.known_failures) == ([], 1, 1)
    assert IntoStore(store, [BROKEN], retry_failed=True).todo == [BROKEN]


def test_what_another_sweep_has_done_meanwhile_is_left_out(store, counted, make_attempt):
    into = IntoStore(store, SCENES)
    with Store(store.path) as other:
        other.record([make_attempt(scene) for scene in SCENES[:5]])
    with ThreadPoolExecutor(1) as threads:
        summary = into.run(threads, in_flight=2)
    assert (summary.computed, summary.found) == (1, 5)
    assert counted == [SCENES[5]]


def test_two_sweeps_at_once_share_the_work(tmp_path, counted):
    scenes = [Scene(particles=10, speed=0.01 * k) for k in range(1, 81)]
    summaries = []

    def one():
        with Store(tmp_path / "shared.sqlite") as store:
            summaries.append(run_in_threads(store, scenes))

    both = [threading.Thread(target=one) for _ in range(2)]
    for thread in both:
        thread.start()
    for thread in both:
        thread.join()
    with Store(tmp_path / "shared.sqlite") as store:
        assert len(store) == 80
    assert all(s.computed + s.found == 80 for s in summaries)


# ---- what goes wrong ----------------------------------------------------------------------------


class Doomed(ThreadPoolExecutor):
    """Executor that fails at once for one scene, by a given error."""

    def __init__(self, scene, error):
        super().__init__(1)
        self.scene, self.error = scene, error

    def submit(self, function, /, *args, **kwargs):
        if args == ([self.scene],):
            future = Future()
            future.set_exception(self.error)
            return future
        return super().submit(function, *args, **kwargs)


@pytest.mark.parametrize("error", [WorkerDiedError("killed by SIGKILL"), OSError("no space")])
def test_a_death_is_recorded_and_the_sweep_goes_on(store, counted, error):
    summary = IntoStore(store, SCENES).run(Doomed(SCENES[2], error), in_flight=2)
    assert (summary.computed, summary.failed) == (5, 1)
    assert store.find(SCENES[2]).failure.message == str(error)
    assert IntoStore(store, SCENES).todo == [SCENES[2]], "it is tried when the sweep is resumed"


@pytest.mark.parametrize("error", [MissingLibraryError("no LAMMPS"), SchedulerError("lost")])
def test_what_concerns_every_collision_ends_the_sweep(store, counted, error):
    with pytest.raises(type(error)):
        IntoStore(store, SCENES).run(Doomed(SCENES[2], error), in_flight=1)
    assert store.find(SCENES[2]) is None


@pytest.mark.parametrize("error", [KeyError("speed"), TypeError("cannot pickle"), ValueError("?")])
def test_an_error_of_the_program_ends_the_sweep_and_keeps_what_is_done(store, counted, error):
    with pytest.raises(type(error)):
        IntoStore(store, SCENES).run(Doomed(SCENES[2], error), in_flight=1)
    assert store.find(SCENES[2]) is None
    assert all(store.get(scene) is not None for scene in counted)


@pytest.mark.parametrize("error", [KeyError("speed"), ZeroDivisionError("0"), ValueError("?")])
def test_only_named_failures_are_failures_of_a_collision(monkeypatch, error):
    def wrong(*_):
        raise error

    monkeypatch.setattr("chaincor.workflows.campaign.work.collide_one", wrong)
    with pytest.raises(type(error)):
        collide_scenes([SCENES[0]])


@pytest.fixture
def interruptible():
    """Restore the handling of SIGINT, which a shell's background jobs ignore."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_an_interruption_keeps_what_is_done(store, make_attempt, monkeypatch):
    finished, heard = [], threading.Event()

    def hear(*_):
        heard.set()
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, hear)

    def interrupting(scenes, **options):
        if len(finished) == 3:
            signal.raise_signal(signal.SIGINT)
            # A collision is running when the main thread is interrupted.
            assert heard.wait(HANGS)
            raise AssertionError("never seen: the sweep is over")
        finished.extend(scenes)
        return [make_attempt(scenes[0]).row.of_scene(scenes[0])]

    monkeypatch.setattr(into_store, "collide_to_rows", interrupting)
    with ThreadPoolExecutor(1) as threads, pytest.raises(KeyboardInterrupt):
        IntoStore(store, SCENES).run(threads, in_flight=2)
    assert all(store.get(scene) is not None for scene in finished)
    assert len(store) == len(finished) == 3


def test_what_was_finished_when_an_interruption_came_is_kept(store, counted):
    class Interrupted(carry_out.SerialExecutor):
        def submit(self, function, /, *args, **kwargs):
            if counted:
                raise KeyboardInterrupt
            return super().submit(function, *args, **kwargs)

    with pytest.raises(KeyboardInterrupt):
        IntoStore(store, SCENES).run(Interrupted(), in_flight=2)
    assert len(store) == len(counted) == 1


def test_a_read_only_store_is_refused_before_anything_is_computed(store, counted):
    with Store(store.path, read_only=True) as closed, pytest.raises(StoreError):
        run_in_threads(closed, SCENES)
    assert counted == []


def failure_of(scene):
    (row,) = collide_to_rows([scene])
    return row.failure


def test_errors_of_the_collision_stand_and_those_of_the_machine_do_not(monkeypatch):
    harmonic = Scene(potential="harmonic", velocity=0.9, particles=5)
    crossing = failure_of(harmonic)
    assert (crossing.name, crossing.stands) == ("CrossingError", True)

    def no_space(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("chaincor.workflows.campaign.work.collide_one", no_space)
    assert failure_of(harmonic).stands is False


# ---- cost ---------------------------------------------------------------------------------------


def test_longer_faster_and_tighter_cost_more(monkeypatch):
    base = Scene(particles=50, speed=0.4)
    seconds = plan(base).seconds
    for changes in ({"particles": 100}, {"speed": 2.0}):
        assert plan(base.replace(**changes)).seconds > seconds
    # This is true within a scheme. If another scheme is chosen, a smaller tolerance may cost less.
    for loose, tight in ((1e-5, 1e-6), (1e-7, 1e-10)):
        wider, closer = (base.replace(tolerance=each) for each in (loose, tight))
        assert plan(closer).seconds > plan(wider).seconds
    cost, single = Forecast.of(requests_of([base] * 10)), Forecast.of(requests_of([base]))
    assert cost.seconds == pytest.approx(10 * seconds)
    start = single.wall_seconds(1) - seconds
    monkeypatch.setattr("chaincor.workflows.campaign.forecast.cores_allowed", lambda: 100)
    assert cost.wall_seconds(2) == pytest.approx(start + 5 * seconds)
    assert cost.wall_seconds(100) == pytest.approx(start + seconds), "one is not divided"
    assert Forecast.of(requests_of([])).wall_seconds(2) == 0.0
    monkeypatch.setattr("chaincor.workflows.campaign.forecast.cores_allowed", lambda: 2)
    assert cost.wall_seconds(100) == pytest.approx(start + 5 * seconds), "workers share the cores"
    assert (
        Forecast.of(requests_of([base]), arrays=True).disk_bytes
        > Forecast.of(requests_of([base])).disk_bytes
    )


def test_many_of_a_kind_cost_less_than_as_many_alone():
    alike = [Scene(particles=20, speed=0.01 * k, engine="reference") for k in range(1, 41)]
    assert Forecast.of(requests_of(alike)).seconds < 0.5 * sum(
        plan(scene).seconds for scene in alike
    )
    broken = [scene.replace(speed=5.0 + scene.speed) for scene in alike]
    assert Forecast.of(requests_of(broken)).seconds == pytest.approx(
        sum(plan(scene).seconds for scene in broken)
    )


def test_a_death_over_several_is_looked_into_one_by_one(store, counted, monkeypatch):
    alike = [Scene(particles=20, speed=0.01 * k, engine="reference") for k in range(1, 41)]
    tasks, alone = [], into_store.collide_to_rows

    def dying(scenes, **options):
        if len(scenes) == 1:
            return alone(scenes, **options)
        tasks.append(scenes)
        raise WorkerDiedError("killed by SIGKILL")

    monkeypatch.setattr(into_store, "collide_to_rows", dying)
    summary = run_in_threads(store, alike)
    assert sum(len(task) for task in tasks) == len(counted) == summary.computed == 40


def test_what_cannot_be_done_together_is_done_alone(store, counted, monkeypatch, make_attempt):
    alike = [Scene(particles=20, speed=0.01 * k, engine="reference") for k in range(1, 41)]

    alone = into_store.collide_to_rows

    def half(scenes, **options):
        if len(scenes) == 1:
            return alone(scenes, **options)
        made = [make_attempt(scene, 0.75).row.of_scene(scene) for scene in scenes]
        return [row if k % 2 else None for k, row in enumerate(made)]

    monkeypatch.setattr(into_store, "collide_to_rows", half)
    summary = run_in_threads(store, alike)
    assert (summary.computed, len(store)) == (40, 40)
    assert len(counted) == 20
    assert sum(store.find(scene).restitution == 0.75 for scene in alike) == 20
    assert run_in_threads(store, alike).found == 40


def test_workers_begin_with_different_bonds(store, monkeypatch, make_attempt):
    begun = []

    def instant(scenes, **options):
        begun.append({scene.label for scene in scenes})
        return [make_attempt(scene).row.of_scene(scene) for scene in scenes]

    monkeypatch.setattr(into_store, "collide_to_rows", instant)
    wide = Scene(particles=10, engine="reference", tolerance=1e-5)
    scenes = [
        wide.replace(potential=name, speed=0.1 + 0.001 * k)
        for name in ("lj", "toda", "log")
        for k in range(64)
    ]
    IntoStore(store, scenes).run(carry_out.SerialExecutor(), in_flight=4)
    assert len(begun) == 12
    assert set.union(*begun[:3]) == {"lj", "toda", "log"}


def test_the_longest_come_first_give_or_take_a_factor_of_two():
    scenes = [Scene(particles=n, speed=0.4) for n in (5, 500, 50, 1000, 10)]
    tasks = sorted(tasks_of(requests_of(scenes), 1), key=turn)
    seconds = [plan(task[0].scene).seconds for task in tasks]
    assert all(later < 2.0 * earlier for earlier, later in itertools.pairwise(seconds))


# ---- real collisions in real processes ----------------------------------------------------------


@pytest.mark.slow
def test_results_do_not_depend_on_the_worker(tmp_path):
    scenes = [Scene(particles=n, speed=s) for n in (5, 10) for s in (0.1, 0.4)]
    rows = collide_into_store(scenes, tmp_path / "a.sqlite", workers=2, arrays=True)
    for scene, row in zip(scenes, rows, strict=True):
        alone = collide(scene)
        assert row.restitution == alone.restitution
        assert row.arrays["contact_times"].tolist() == alone.contact_times.tolist()


@pytest.mark.slow
@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="finds its victims in /proc")  # noqa: PTH112
def test_kills_lose_nothing(tmp_path):
    # A hundred of them: python -m tests.workflows.campaign.kills 100
    pytest.importorskip("distributed")
    study = kills.study_kills(len(kills.KINDS), tmp_path, points=5)
    assert set(study.kills) == set(kills.KINDS)


def test_rows_without_details_keep_their_columns_and_take_less_room(tmp_path):
    base = Scene(particles=3, engine="reference", tolerance=1e-4)
    scenes = [base.replace(speed=0.001 * k) for k in range(1, 201)]
    rows = {}
    for details in (True, False):
        with Store(tmp_path / f"{details}.sqlite") as store:
            IntoStore(store, scenes, details=details).run(carry_out.SerialExecutor(), in_flight=1)
            rows[details] = [store.find(scene) for scene in scenes]
    for whole, short in zip(rows[True], rows[False], strict=True):
        assert short.columns["details"] is None
        names = ("restitution", "restitution_error", "contacts", "velocity", "scheme", "scene")
        assert [short.columns[name] for name in names] == [whole.columns[name] for name in names]
        assert short.result["restitution"] == whole.result["restitution"]
        assert short.result.keys() < whole.result.keys()
    sizes = [(tmp_path / f"{details}.sqlite").stat().st_size for details in (True, False)]
    # Details take half of the space of a plain row; empty tables take 30 kB.
    assert sizes[1] < 0.65 * sizes[0]
    with Store(tmp_path / "False.sqlite") as store:
        # Rows without details are results, and are not computed again.
        assert IntoStore(store, scenes).todo == []
        store.record([(scenes[0], Row.of(collide(scenes[0])))], replace=True)
        assert store.find(scenes[0]).columns["details"] is not None


class _Recording(carry_out.SerialExecutor):
    """Record the rows that come from workers."""

    def __init__(self):
        self.rows = []

    def submit(self, function, /, *args, **kwargs):
        future = super().submit(function, *args, **kwargs)
        self.rows += future.result()
        return future


@pytest.mark.parametrize("arrays", [False, True])
def test_workers_send_arrays_only_if_a_row_needs_them(store, arrays):
    scenes = [Scene(particles=n, engine="reference", tolerance=1e-4) for n in (2, 3)]
    IntoStore(store, scenes[:1], arrays=arrays).run(carry_out.SerialExecutor(), in_flight=1)
    # Without this request, the tighter results of rows with arrays must bring their arrays along.
    executor, tight = _Recording(), [scene.replace(tolerance=1e-7) for scene in scenes]
    IntoStore(store, tight).run(executor, in_flight=1)
    assert [bool(row.arrays) for row in executor.rows] == [arrays, arrays]
    kept = [store.find(scene, arrays=True).arrays for scene in tight]
    assert [bool(each) for each in kept] == [arrays, False]
    if arrays:
        assert kept[0]["contact_times"].tolist() == collide(tight[0]).contact_times.tolist()


def test_a_better_result_without_arrays_drops_those_of_the_older_result(store, make_attempt):
    loose = SCENES[0].replace(tolerance=1e-4)
    store.record([make_attempt(loose, error=1e-5)], arrays=True)
    assert store.has_arrays()
    tight = make_attempt(loose.replace(tolerance=1e-7), error=1e-8)
    store.record([(tight.scene, Row(tight.row.columns))])
    assert store.find(loose, arrays=True).arrays == {}
    assert not store.has_arrays()
    assert store.find(loose).restitution_error == 1e-8
