"""Test that the history of the benchmarks is read back and names the slower benchmarks."""

import pytest

from benchmarks import __main__ as standing

COST, GAIN, PEER = (
    "event over bare run, n 100, lj 0.4",
    "gain over the stock recipe at 1 times its time, lj 0.4",
    "heyoka over in-house order8, last",
)


def test_the_last_figures_of_the_newest_file_count(tmp_path):
    assert standing.read_last(tmp_path / "none") == {}
    folder = tmp_path / "history"
    folder.mkdir()
    (folder / "2001-01-01.csv").write_text("figure,value\nold,3.0\n")
    standing.record({"a": {COST: 1.5, GAIN: 4516.0}}, folder)
    standing.record({"a": {COST: 1.25}, "b": {PEER: 8.0}}, folder)
    assert standing.read_last(folder) == {COST: 1.25, GAIN: 4516.0, PEER: 8.0}


@pytest.mark.parametrize(
    ("name", "before", "worse", "noise"),
    [(COST, 1.2, 2.0, 1.7), (GAIN, 1e6, 1e4, 1e5), (PEER, 8.0, 4.0, 6.0)],
)
def test_clearly_worse_is_a_regression_and_noise_is_none(name, before, worse, noise):
    (line,) = standing.regressions({name: worse}, {name: before})
    assert name in line
    assert f"was {before:.3g}" in line
    assert standing.regressions({name: noise}, {name: before}) == []
    # A benchmark that becomes faster by any factor is no regression.
    assert standing.regressions({name: before}, {name: worse}) == []


def test_a_new_figure_is_compared_with_nothing():
    assert standing.regressions({"new": 1e9}, {COST: 1.0}) == []


def test_the_kept_history_is_readable_and_says_nothing_trivial():
    figures = standing.read_last(standing.HISTORY)
    assert len(figures) > 20
    for name, value in figures.items():
        assert value > 0.0
        ours, _, theirs = name.partition(" over in-house ")
        assert ours != theirs.split(",")[0]
