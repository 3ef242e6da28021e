"""Test that new scenes agree with the measured constants, and that their file is complete."""

import numpy as np
import pytest

from benchmarks.bars.calibrate import CONSTANTS, SCHEMES, Constant, draw
from benchmarks.bars.scheme_costs import best_table
from chaincor.workflows.accuracy.bounded_run import PROOF_SHARE
from chaincor.workflows.engines.rounding import ARITHMETIC_FLOOR, COORDINATE_ROUNDING
from chaincor.workflows.measured import measured, measurements

# No file uses this seed, so the constants were not measured with these scenes.
SEED = 99
# These studies take seconds. A quantile of at least 0.98, times its safety factor, covers the few
# scenes of the test.
QUICK = {
    "proof_share": (3, PROOF_SHARE),
    "coordinate_rounding": (3, COORDINATE_ROUNDING),
    "arithmetic_floor": (10, ARITHMETIC_FLOOR),
    "unseen_stretch": (3, measured("unseen_stretch")),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_a_few_more_scenes_need_no_more_than_what_is_taken(name):
    count, value = QUICK[name]
    for key, samples in CONSTANTS[name].study(draw(name, SEED), count).items():
        assert len(samples) == count
        assert max(samples) <= (value[key] if key else value), (name, key)
        assert max(samples) > 0.0, "a study that finds nothing measures nothing"


def test_the_file_has_every_constant_and_says_how_it_came_about():
    assert set(measurements()) == {*CONSTANTS, *SCHEMES}
    for name, entry in measurements().items():
        made_by = {"what", "seed", "scenes", "chaincor", "lammps"}
        assert made_by <= set(entry), name
        if name in SCHEMES:
            assert 1.0 <= entry["loss"] < 1.34, "choosing by tolerance alone may lose a third"
            continue
        for key in entry["value"] if isinstance(entry["value"], dict) else [None]:
            value, found = (
                entry[each] if key is None else entry[each][key] for each in ("value", "found")
            )
            # Constants are rounded up to two digits, or down if they are lower bounds.
            assert value == pytest.approx(entry["reserve"] * found, rel=0.11), (name, key)


def test_a_constant_is_its_quantile_times_its_reserve():
    constant = Constant(lambda *_: {}, quantile=0.5, reserve=1.5)
    assert constant.value([1.0, 2.0, 30.0]) == (2.0, 3.0)


def test_a_choice_counts_where_it_is_larger_than_what_was_measured():
    found = measurements()["nudge_reserve"]["value"]
    assert measured("nudge_reserve", 2.0 * found) == 2.0 * found
    assert measured("nudge_reserve", 0.5 * found) == found
    each = measurements()["usual_error"]["value"]
    larger = measured("usual_error", each | {"verlet": 9.0})
    assert larger == each | {"verlet": 9.0}


def test_a_table_of_schemes_is_the_cheapest_that_never_goes_back():
    def losses(cheapest):
        return {name: 0.0 if name == cheapest else 1.0 for name in ("a", "b", "c")}

    table, loss = best_table({1e-2: losses("a"), 1e-3: losses("a"), 1e-4: losses("c")})
    assert table == {"a": 3e-4, "c": 0.0}
    assert loss == 1.0
    # A single target error that is out of order is ignored.
    table, loss = best_table({10.0**-k: losses("ac"[k == 5]) for k in range(2, 9)})
    assert table == {"a": 0.0}
    assert loss == pytest.approx(np.exp(1.0 / 7.0))
