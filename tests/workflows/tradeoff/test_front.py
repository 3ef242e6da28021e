"""Test promised errors, the Pareto front, the cheapest setting, and the advice."""

import numpy as np
import pytest

from benchmarks.blind_settings import numerics_in, promised_in
from chaincor import collide
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.tradeoff.front import (
    RESERVE,
    advise_setting,
    cheapest_settings,
    format_seconds,
    pareto_front,
    promised_errors,
)
from chaincor.workflows.tradeoff.reference_solution import Deviation
from chaincor.workflows.tradeoff.settings import Measurement, Setting, time_unit

VERLET = ("lammps", "event", "verlet", "spline")
ORDER8 = ("lammps", "event", "order8", "spline")
IN_HOUSE = ("reference", "event", "order8", None)
SCENE = Scene()


def measured(series, timestep, errors, seconds, failure=None):
    deviations = [Deviation(error, 0.0, 0.0) for error in np.atleast_1d(errors)]
    return Measurement(
        Setting(*series, timestep), deviations, [seconds] * len(deviations), failure=failure
    )


def test_phases_give_median_rms_and_worst():
    each = measured(VERLET, 0.1, [1e-3, -2e-3, 2e-3, 7e-3], 1.0)
    assert each.median_error == pytest.approx(2e-3)
    assert each.rms_error == pytest.approx(np.sqrt((1 + 4 + 4 + 49) / 4) * 1e-3)
    assert each.worst_error == pytest.approx(7e-3)


def test_a_lucky_step_promises_no_more_than_the_finer_ones_keep():
    study = [measured(VERLET, h, e, 1.0) for h, e in ((0.1, 1e-9), (0.05, 1e-5), (0.025, 2e-6))]
    promises = promised_errors(study)
    reserve = RESERVE["verlet"]
    assert promises[Setting(*VERLET, 0.025)] == pytest.approx(reserve * 2e-6)
    assert promises[Setting(*VERLET, 0.05)] == pytest.approx(reserve * 1e-5)
    assert promises[Setting(*VERLET, 0.1)] == pytest.approx(reserve * 1e-5)


def test_no_setting_on_the_front_is_beaten():
    rng = np.random.default_rng(1)
    study = [measured(VERLET, 1.0 + k, 10 ** rng.uniform(-9, -1), rng.random()) for k in range(60)]
    study.append(measured(VERLET, 0.5, [], 0.0, failure="too large a step"))
    front = pareto_front(study)
    assert 0 < len(front) < 60
    for each in study[:-1]:
        beaten = any(f.time <= each.time and f.rms_error <= each.rms_error for f in front)
        assert beaten
    assert [f.time for f in front] == sorted(f.time for f in front)
    assert [f.rms_error for f in front] == sorted((f.rms_error for f in front), reverse=True)


@pytest.fixture
def study():
    return [
        measured(VERLET, 0.1, 1e-4, 0.01),
        measured(VERLET, 0.01, 1e-6, 0.10),
        measured(ORDER8, 0.4, 1e-6, 0.05),
        measured(ORDER8, 0.2, 1e-9, 0.20),
        measured(IN_HOUSE, 0.2, 1e-12, 0.001),
        measured(ORDER8, 0.8, [], 0.0, failure="too large a step"),
    ]


def test_the_cheapest_setting_of_each_decade_keeps_it(study):
    rows = cheapest_settings(SCENE, study, "lammps")
    promises = promised_errors(study)
    # The smallest error that LAMMPS promises here is 20 times 1e-9, so that 1e-7 is the last
    # decade.
    assert [row.error for row in rows] == pytest.approx([10.0**-k for k in range(2, 8)])
    assert all(promises[row.setting] <= row.error for row in rows)
    steps = [row.setting.timestep for row in rows]
    assert steps == [0.1, 0.4, 0.4, 0.2, 0.2, 0.2]
    assert cheapest_settings(SCENE, study, "reference")[0].setting == Setting(*IN_HOUSE, 0.2)


def test_rows_carry_over_to_other_scenes_by_the_fastest_bond(study):
    row = cheapest_settings(SCENE, study, "lammps")[0]
    assert numerics_in(SCENE, row).timestep == pytest.approx(0.1)
    hard, soft = Scene(speed=1.0), Scene(speed=0.01)
    ratio = time_unit(hard, "event") / time_unit(soft, "event")
    assert ratio < 0.7
    assert numerics_in(hard, row).timestep / numerics_in(soft, row).timestep == pytest.approx(ratio)
    # For slow chains, rounding of LAMMPS's coordinates limits the promise.
    slow = Scene(speed=1e-8)
    assert promised_in(SCENE, row) == row.error
    assert promised_in(slow, cheapest_settings(SCENE, study, "lammps")[-1]) > 1e-7


def test_advice_is_one_line_with_the_cheapest_good_setting(study):
    rows = cheapest_settings(SCENE, study, "lammps")
    assert (
        advise_setting(SCENE, rows, 1e-4) == "1e-04 costs 50 ms: LAMMPS, event wall, order8, H 0.4"
    )
    assert (
        advise_setting(SCENE, rows, 1e-2) == "1e-02 costs 10 ms: LAMMPS, event wall, verlet, H 0.1"
    )
    assert "no measured setting has an error of" in advise_setting(SCENE, rows, 1e-9)
    assert "nothing" in advise_setting(SCENE, [], 1e-9)


def test_advice_tells_of_steps_that_only_a_tolerance_can_choose(study):
    rows = cheapest_settings(SCENE, study, "lammps")
    assert advise_setting(SCENE, rows, 1e-7).endswith("order8, H 0.2; quicker: --tolerance 1e-07")
    assert advise_setting(SCENE, rows, 1e-8).endswith("; --tolerance 1e-08 may reach it")
    chosen = collide(SCENE.replace(particles=5), tolerance=1e-8)
    assert chosen.scheme == "extrapolated12"
    # Slow chains do not get extrapolated steps, which would amplify rounding.
    slow = Scene(speed=1e-5)
    assert advise_setting(slow, rows, 1e-8).endswith("1e-08 (reached: 1e-07)")
    assert collide(slow.replace(particles=5), tolerance=1e-8).scheme != "extrapolated12"


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.0604, "60 ms"), (0.0014, "1.4 ms"), (2.34, "2.3 s"), (12e-6, "0.012 ms")],
)
def test_times_have_two_digits(seconds, text):
    assert format_seconds(seconds) == text
