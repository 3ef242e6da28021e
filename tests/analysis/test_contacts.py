import pytest

from chaincor.analysis.contacts import contact_statistics


def test_statistics_of_a_short_list():
    statistics = contact_statistics([1.0, 3.0, 6.0, 7.0], [1.0, 2.0, 3.0, 2.0], 5, 2.0)
    assert statistics.count == 4
    assert statistics.per_particle == pytest.approx(0.8)
    assert statistics.last_time == 6.0
    assert statistics.mean_interval == pytest.approx(2.0)
    assert statistics.median_interval == pytest.approx(2.0)
    assert statistics.mean_speed == pytest.approx(1.0)


@pytest.mark.parametrize("times", [[], [0.0]])
def test_what_cannot_be_averaged_is_none(times):
    statistics = contact_statistics(times, [1.0] * len(times), 1, 1.0)
    assert statistics.count == len(times)
    assert statistics.mean_interval is None
    assert statistics.median_interval is None
