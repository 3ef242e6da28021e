"""Test the modulated wave, from which steep fronts start, against its laws and against the step."""

import numpy as np
import pytest

from benchmarks.slow_chains.lag import determinant_lag, determinant_wave, moved_wave, soliton_lag
from benchmarks.slow_chains.modulated import TABLE, modulated_minima, modulated_wave
from benchmarks.slow_chains.spectral import spectral_minima


def crests(x, wave):
    """Return the positions and heights of the crests, the leading crest first."""
    inside = (wave[1:-1] > wave[:-2]) & (wave[1:-1] >= wave[2:])
    here = np.flatnonzero(inside)[::-1] + 1
    return x[here], wave[here]


@pytest.mark.parametrize("time", [50.0, 400.0])
def test_leading_solitons_lag_behind_the_edge_of_the_train(time):
    x = np.arange(2.0 * time, 4.5 * time, 0.01)
    places, heights = crests(x, modulated_wave(x, time))
    n = np.arange(1, 4) - 0.25
    # Next to the edge 1 - m = n/(2 t), with a relative error of n/t times its logarithm.
    lags = n * (1.0 + np.log(32.0 * time / n)) - 0.25 * np.log(64.0)
    assert 4.0 * time - places[:3] == pytest.approx(lags, rel=3.0 * n[-1] / time)
    assert heights[:3] == pytest.approx(2.0 - n / (2.0 * time), abs=3.0 * n[-1] / time**1.5)


@pytest.mark.parametrize("number", [1, 2])
def test_solitons_of_the_determinant_approach_the_late_form(number):
    # The next term is of the order ln t/t. The lag is known to 1e-6.
    early, late = (
        (determinant_lag(number, t) - soliton_lag(number, t)) * t / np.log(64.0 * t)
        for t in (100.0, 400.0)
    )
    assert early == pytest.approx(late, rel=0.15)
    # The modulated train has Stirling's form, which is smaller by 1/(96 k - 24) + O(k^-3).
    n, t = number - 0.25, 100.0
    stirling = n * (1.0 + np.log(32.0 * t / n)) - 0.25 * np.log(64.0)
    assert soliton_lag(number, t) - stirling == pytest.approx(1.0 / (96.0 * n), rel=0.03)


def test_determinant_is_the_front_of_a_step():
    # These are the lags by finite differences at y = 20, with errors of 1e-3.
    time = 10.0**1.5 / 3.0
    lags = [determinant_lag(number, time) for number in (1, 2, 3)]
    assert lags == pytest.approx([4.329, 10.038, 15.192], abs=2e-3)
    # Before the second crest, u falls almost to its level ahead of the train.
    assert determinant_wave(4.0 * time - 7.2, time) < 0.1


@pytest.mark.slow
def test_modulated_start_agrees_with_the_step():
    variable = 60.0
    _, loss, error = spectral_minima(variable, 3)[0]
    _, started = modulated_minima(variable)[0]
    # The modulated wave has an error of about 0.004 y/t, with t = 55.
    assert started / variable == pytest.approx(loss / variable, abs=1e-4 + error / variable)


def test_two_grids_agree_within_the_bar_of_the_page():
    variable, spacing, _, loss = np.loadtxt(TABLE, delimiter=",", skiprows=1).T
    for y in np.unique(variable):
        deepest = [loss[(variable == y) & (spacing == grid)].min() / y for grid in (0.36, 0.3)]
        assert abs(deepest[0] - deepest[1]) < 2.5e-4


def test_moved_solitons_keep_their_height_and_the_others_their_place():
    time, length = 50.0, 0.4
    x = np.arange(2.0 * time, 4.5 * time, 0.005)
    places, heights = crests(x, modulated_wave(x, time))
    moved, kept = crests(x, moved_wave(x, time, 2, length))
    # Crests are on grid points, and the tail of the smooth shift is below 1e-8 at neighbouring
    # crests.
    assert places[:4] - moved[:4] == pytest.approx([length, length, 0.0, 0.0], abs=0.0051)
    assert kept[:4] == pytest.approx(heights[:4], abs=1e-4)
