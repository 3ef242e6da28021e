"""Test which slow chains are used for the common curve, and C of each bond."""

import pytest

from chaincor.analysis.slow_chains.curve import (
    FRONT_LEAD,
    slow_chain_dissipation,
)
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.figures.slow_chains import (
    figure,
    infinite_chain,
    means,
    slopes_by_bond,
    slow_long_chains,
    study,
    variable_of,
)
from chaincor.workflows.reproduce.measurements import Answer, MeasuredPoint, Measurements
from chaincor.workflows.reproduce.plan import QUICK


def measurements():
    """Return chains whose loss is that of the theory."""

    def point(scene):
        if variable_of(MeasuredPoint(scene, None, None)) < 30.0:
            n, velocity = scene.particles, scene.impact_velocity
            loss = slow_chain_dissipation(scene.bond, n, velocity)
        else:
            loss = 0.9
        return MeasuredPoint(
            scene, None, Answer({"restitution": 1.0 - loss, "restitution_error": 1e-8})
        )

    others = [
        Scene(potential="lj", particles=n, speed=u) for n in (10, 1000) for u in (0.01, 0.1, 0.5)
    ]
    points = {
        "slow_chains": study(QUICK).reference,
        "slopes": others,
        "sizes": others,
        "curves": (),
    }
    return Measurements(QUICK, (), {key: tuple(map(point, ps)) for key, ps in points.items()})


def test_short_and_fast_chains_do_not_count_and_others_once():
    groups = slow_long_chains(measurements())
    assert set(groups) == {"lj", "toda, b = 3", "toda, b = 10", "toda, b = 30", "log"}
    lj = groups["lj"]
    # There are five lengths near each size. At n = 30, the limit 0.6 n^(2/3) is 5.8, which excludes
    # some values of y. At n = 1000, speeds of 0.01 and 0.1 v* have y = 2.7 and 27.
    assert len(lj) == 5 * (len(QUICK.slow_sizes) * len(QUICK.slow_variables) - 1) + 2
    assert len({(p.particles, p.scene.impact_velocity) for p in lj}) == len(lj)
    for p in lj:
        assert variable_of(p) <= 0.6001 * p.particles ** (2.0 / 3.0)
        assert p.dissipation < 0.9


def test_means_average_the_phase_and_have_bars():
    rows = means(measurements())
    lj = [row for row in rows if row.bond == "lj"]
    assert [row.size for row in lj[:4]] == [30] * 3 + [100]
    for row in rows:
        assert row.chains == (1 if row.bond in ("toda, b = 3", "toda, b = 30") else 5)
        # At any length, chains with the theory's loss have the distance 2 beta.
        assert row.distance == pytest.approx(2.0 * FRONT_LEAD, rel=1e-3)
        assert row.error > 0.0
    assert {"distance_error", "chains"} <= set(figure(measurements()).records[0])


def test_slopes_are_those_of_the_longest_steep_chain():
    rows = {row["bond"]: row for row in slopes_by_bond(measurements())}
    assert [round(rows[name]["slope"], 3) for name in ("lj", "toda, b = 3", "log")] == [
        1.012,
        0.951,
        0.725,
    ]
    for row in rows.values():
        assert row["measured"] == pytest.approx(row["expected"], rel=1e-9)
        # The chain is the longest of the five near 1000, or the only chain of 1000 for other b of
        # toda.
        assert row["particles"] in (1000, 1060)
    # The fastest of the chains of 1060 is used.
    assert rows["lj"]["variable"] == pytest.approx(max(QUICK.slow_variables), rel=1e-4)
    assert (rows["lj"]["paper_simulation"], rows["log"]["paper_simulation"]) == (0.66, None)
    assert "1.012 for lj" in infinite_chain(measurements())
