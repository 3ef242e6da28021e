"""Test the rule that decides which of two stored results is kept."""

import functools
import itertools
import math

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.into_store import IntoStore
from chaincor.workflows.errors import CrossingError
from chaincor.workflows.store.merge import merge_stores
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.row import Row

SCENE = Scene(potential="lj", particles=10, speed=0.4, tolerance=1e-6)
FAILED = Row(
    {
        "restitution": None,
        "restitution_error": None,
        "tolerance": 1e-6,
        "failure_tolerance": 1e-6,
        "failure_stands": 1,
        "tries": 1,
        "finished": "2026-01-01T00:00:00.000+00:00",
        "has_arrays": 0,
    }
)
NO_FAILURE = {"failure_tolerance": None, "failure_stands": None}
RESULT = Row(FAILED.columns | NO_FAILURE | {"restitution": 0.5, "restitution_error": 2e-7})
LATER = "2026-01-02T00:00:00.000+00:00"


def altered(standing, **changes):
    return Row(standing.columns | changes)


# ---- the rule -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("better", "worse"),
    [
        (RESULT, FAILED),
        (altered(RESULT, restitution_error=None), altered(FAILED, finished=LATER)),
        (RESULT, altered(RESULT, restitution_error=3e-7)),
        (RESULT, altered(RESULT, restitution_error=3e-7, tolerance=1e-8)),
        (RESULT, altered(RESULT, restitution_error=3e-7, has_arrays=True)),
        (RESULT, altered(RESULT, restitution_error=None, tolerance=1e-8, has_arrays=True)),
        (altered(RESULT, has_arrays=True), RESULT),
        (altered(FAILED, finished=LATER), FAILED),
    ],
)
def test_the_better_of_two_stays_whichever_was_first(better, worse):
    assert worse.yields_to(better)
    assert not better.yields_to(worse)


@pytest.mark.parametrize("standing", [RESULT, FAILED, altered(RESULT, restitution_error=None)])
def test_of_equal_ones_the_first_stays(standing):
    assert not standing.yields_to(standing)
    assert not standing.yields_to(altered(standing, tries=2))


def test_what_is_computed_anew_on_purpose_replaces_what_was_asked_no_more_exactly():
    wider = altered(RESULT, restitution_error=3e-7)
    assert RESULT.yields_to(wider, renew=True)
    assert RESULT.yields_to(altered(wider, tolerance=1e-8), renew=True)
    assert not RESULT.yields_to(altered(wider, tolerance=1e-4), renew=True)
    assert not RESULT.yields_to(altered(RESULT, restitution_error=None), renew=True)
    explicit = altered(RESULT, tolerance=None)
    assert explicit.yields_to(altered(wider, tolerance=None), renew=True)


@pytest.mark.parametrize(
    ("asked", "met"), [(3e-7, True), (2e-7, True), (1e-7, False), (1e-12, False)]
)
def test_what_stays_stands_for_the_tightest_tolerance(asked, met):
    columns = RESULT.tightened_by(altered(RESULT, tolerance=asked, restitution_error=5e-7))
    assert columns["tolerance"] == asked
    assert columns["tolerance_met"] is met
    assert (columns["reason"] is None) is met
    assert met or f"not {asked:g}" in columns["reason"]


def test_what_no_run_has_met_stands_for_nothing_tighter():
    assert RESULT.tightened_by(RESULT) == {}
    assert RESULT.tightened_by(altered(RESULT, tolerance=1e-4)) == {}
    assert RESULT.tightened_by(altered(FAILED, tolerance=1e-8)) == {}
    assert altered(FAILED, tolerance=1e-4).tightened_by(RESULT) == {}


def join(kept, other):
    """Return the result in a store after a merge."""
    if kept.yields_to(other):
        kept, other = other, kept
    changes = kept.tightened_by(other)
    return altered(kept, tolerance=changes.get("tolerance", kept.columns["tolerance"]))


def test_the_order_of_merging_does_not_matter():
    standings = [
        altered(RESULT, restitution_error=error, tolerance=tolerance, has_arrays=arrays)
        for error in (None, 1e-9, 3e-7)
        for tolerance in (1e-6, 1e-8)
        for arrays in (False, True)
    ] + [FAILED]
    for three in itertools.combinations(standings, 3):
        stays, *others = (functools.reduce(join, order) for order in itertools.permutations(three))
        assert all(other.columns == stays.columns for other in others), three
        results = [standing for standing in three if standing.has_result]
        assert stays.reached == min(standing.reached for standing in results)
        assert stays.columns["tolerance"] == min(row.columns["tolerance"] for row in results)


# ---- recording, merging and resuming go by it ---------------------------------------------------

TOLERANCES = (1e-4, 1e-6, 1e-8)
ERRORS = (math.inf, 1e-3, 5e-7, 2e-7, 1e-9)
RUNS = tuple(itertools.product(TOLERANCES, ERRORS))


@pytest.fixture
def pairs(make_attempt):
    """Return attempts for every pair of runs of a collision; each pair has its own speed."""
    made = []
    for k, runs in enumerate(itertools.product(RUNS, RUNS)):
        scene = SCENE.replace(speed=0.1 + 0.001 * k)
        first, second = (
            make_attempt(scene.replace(tolerance=tolerance), restitution, error)
            for restitution, (tolerance, error) in zip((0.51, 0.52), runs, strict=True)
        )
        made.append((first, second))
    return made


def reached(row):
    return math.inf if row.restitution_error is None else row.restitution_error


def check_rows(store, pairs):
    for pair in pairs:
        first, second = (attempt.row for attempt in pair)
        kept = second if reached(second) < reached(first) else first
        tightest = min(attempt.scene.tolerance for attempt in pair)
        result = store.find(pair[0].scene).result
        assert result["restitution"] == kept.restitution
        assert result["tolerance"] == tightest
        assert result["tolerance_met"] == (reached(kept) <= tightest)
        for attempt in pair:
            assert not IntoStore(store, [attempt.scene]).todo, "it would run for ever"


def test_a_record_keeps_the_smaller_error_and_is_not_run_again(store, pairs):
    for k in range(2):
        store.record([pair[k] for pair in pairs])
    check_rows(store, pairs)


def test_a_merge_keeps_the_smaller_error_and_is_not_run_again(tmp_path, pairs):
    paths = [tmp_path / "first.sqlite", tmp_path / "second.sqlite"]
    for k, path in enumerate(paths):
        with Store(path) as part:
            part.record([pair[k] for pair in pairs])
    target = tmp_path / "merged.sqlite"
    for _ in range(2):  # the second time changes nothing
        merge_stores(target, paths)
        with Store(target) as merged:
            check_rows(merged, pairs)


def test_arrays_are_computed_once_whatever_the_second_run_reaches(store, pairs):
    # A run without an error bar does not replace a run with one.
    pairs = [pair for pair in pairs if pair[1].row.restitution_error is not None]
    store.record([first for first, _ in pairs])
    again = []
    for first, second in pairs:
        (planned,) = IntoStore(store, [second.scene], arrays=True).todo
        assert planned.tolerance == min(first.scene.tolerance, second.scene.tolerance)
        row = Row(second.row.columns | {"tolerance": planned.tolerance}, second.row.arrays)
        again.append((planned, row))
    store.record(again, arrays=True)
    assert not IntoStore(store, [second.scene for _, second in pairs], arrays=True).todo
    for _, second in pairs:
        kept = store.find(second.scene, arrays=True)
        assert kept.arrays["contact_times"][1] == kept.restitution == 0.52


def test_recomputing_asks_for_no_less_than_before(store, make_attempt):
    tight, loose = SCENE.replace(tolerance=1e-8), SCENE.replace(tolerance=1e-4)
    store.record([make_attempt(tight, 0.51)])
    (planned,) = IntoStore(store, [loose], recompute=True).todo
    assert planned.tolerance == 1e-8
    store.record([make_attempt(planned, 0.52, 7e-9)], replace=True)
    assert store.get(tight).restitution == 0.52
    store.record([make_attempt(loose, 0.53)], replace=True)
    assert store.get(tight).restitution == 0.52, "it was asked for more exactly"


def test_a_missed_tolerance_clears_the_failure_before_it(store, make_attempt, make_failure):
    tight = SCENE.replace(tolerance=1e-8)
    store.record([make_attempt(SCENE, 0.51, 2e-7), make_failure(tight)])
    assert store.find(SCENE).failure is not None
    store.record([make_attempt(tight, 0.52, 5e-7)])
    row = store.find(SCENE)
    assert (row.restitution, row.failure, row.columns["tries"]) == (0.51, None, 3)
    assert row.result["reason"].startswith("the error reached is 2e-07, not 1e-08")


def test_of_two_failures_a_merge_keeps_the_later(tmp_path, make_failure):
    paths = [tmp_path / "first.sqlite", tmp_path / "second.sqlite"]
    for path, name in zip(paths, ("first", "second"), strict=True):
        with Store(path) as part:
            part.record([make_failure(SCENE, CrossingError(name))])
            part.connection.execute(
                "UPDATE collisions SET finished = ?", (2 if name == "second" else 1,)
            )
    for order in (paths, paths[::-1]):
        target = tmp_path / f"from-{order[0].stem}.sqlite"
        merge_stores(target, order)
        with Store(target) as merged:
            assert merged.find(SCENE).failure.message == "second"


def test_explicit_numerics_without_a_bar_are_not_run_again(store, make_attempt):
    explicit = Scene(potential="lj", particles=10, speed=0.4, scheme="verlet")
    store.record([make_attempt(explicit, error=math.inf)])
    assert store.find(explicit).restitution_error is None
    assert not IntoStore(store, [explicit]).todo
