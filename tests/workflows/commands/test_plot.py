"""Test that chaincor plot draws one curve for each scene and averages none."""

import numpy as np
import pytest

from chaincor import collide
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.row import Row

SPEEDS = (0.02, 0.05, 0.1)


@pytest.fixture(scope="module")
def collisions():
    """Return a store with 18 collisions: two potentials, three lengths, three speeds."""
    scenes = [
        Scene(potential=potential, particles=n, velocity=v, engine="reference", tolerance=1e-6)
        for potential in ("lj", "toda")
        for n in (2, 3, 5)
        for v in SPEEDS
    ]
    return [(scene, Row.of(collide(scene))) for scene in scenes]


@pytest.fixture
def store_path(collisions, tmp_path):
    with Store(tmp_path / "s.sqlite") as store:
        store.record(collisions)
    return tmp_path / "s.sqlite"


@pytest.fixture
def plot(store_path, chaincor, monkeypatch):
    """Return a function that runs the command and returns exit status, message and curves."""
    drawn = {}

    def keep(curves, *names, **options):
        drawn.update(curves)
        return original(curves, *names, **options)

    from chaincor.analysis.figures import store_plots

    original = store_plots.plot_curves
    monkeypatch.setattr(store_plots, "plot_curves", keep)

    def run(*arguments):
        drawn.clear()
        status, _, err = chaincor("plot", store_path, *arguments)
        return status, err, dict(drawn)

    return run


def test_without_by_there_is_a_curve_for_each_combination_of_what_varies(plot, collisions):
    status, _, curves = plot("--x", "velocity")
    assert status == 0
    assert set(curves) == {
        f"potential = {p}, particles = {n}" for p in ("lj", "toda") for n in (2, 3, 5)
    }
    for scene, row in collisions:
        x, y = curves[f"potential = {scene.potential}, particles = {scene.particles}"]
        assert tuple(x) == SPEEDS
        # Every point is the result of a single collision, not a mean.
        assert y[x.index(scene.velocity)] == row.restitution


def test_a_by_that_leaves_something_to_vary_is_refused_by_name(plot):
    status, error, curves = plot("--x", "velocity", "--by", "potential")
    assert (status, curves) == (2, {})
    assert "particles (3 values)" in error
    assert "--by potential,particles" in error
    assert error.count("\n") == 1
    status, _, curves = plot("--x", "velocity", "--by", "potential,particles")
    assert (status, len(curves)) == (0, 6)
    status, _, curves = plot("--x", "velocity", "--by", "potential", "--where", "particles=3")
    assert (status, sorted(curves)) == (0, ["potential = lj", "potential = toda"])


def test_the_impact_speed_tells_curves_apart_over_other_axes(plot):
    status, _, curves = plot("--x", "particles", "--where", "potential=lj")
    assert status == 0
    assert len(curves) == 3
    assert all(name.startswith("speed = ") for name in curves)
    assert all(list(x) == [2, 3, 5] for x, _ in curves.values())


def test_over_a_result_points_are_followed_by_impact_speed(plot, collisions):
    status, _, curves = plot("--x", "contacts", "--where", "potential=lj")
    assert status == 0
    assert set(curves) == {"particles = 2", "particles = 3", "particles = 5"}
    for n in (2, 3, 5):
        own = [row for s, row in collisions if (s.particles, s.potential) == (n, "lj")]
        assert curves[f"particles = {n}"] == (
            [row.columns["contacts"] for row in own],
            [row.restitution for row in own],
        )


def test_a_heat_map_over_several_scenes_is_refused(plot):
    status, error, _ = plot("--x", "velocity", "--y", "particles", "--colour", "restitution")
    assert status == 2
    assert "scenes with equal velocity and particles differ in potential (2 values)." in error
    assert error.count("\n") == 1
    options = ("--colour", "restitution", "--where", "potential=lj")
    assert plot("--x", "velocity", "--y", "particles", *options)[0] == 0


@pytest.mark.parametrize("role", ["--x", "--y", "--colour"])
def test_words_make_no_axis(plot, role):
    columns = {"--x": "velocity", "--y": "particles", "--colour": "restitution", role: "scheme"}
    options = [word for pair in columns.items() for word in pair]
    status, error, _ = plot(*options, "--where", "potential=lj")
    assert status == 2
    assert "column 'scheme' holds '" in error
    assert "which an axis cannot show" in error
    assert error.count("\n") == 1


def test_a_heat_map_never_averages():
    from chaincor.analysis.figures.store_plots import plot_heat_map
    from chaincor.lammps_inputs.errors import InputError

    axes = plot_heat_map([1, 2, 1], [1, 1, 2], [5, 6, 7], labels=("x", "y", "c"))
    mesh = axes.collections[0].get_array()
    np.testing.assert_array_equal(np.ma.compressed(mesh), [5, 6, 7])
    with pytest.raises(InputError, match="several collisions"):
        plot_heat_map([1, 2, 1], [1, 1, 1], [5, 6, 7], labels=("x", "y", "c"))


@pytest.fixture(scope="module")
def warm_collisions():
    """Return a store of a warm chain at two speeds and with five seeds."""
    scenes = [
        Scene(
            potential="toda",
            particles=3,
            velocity=v,
            temperature=1e-4,
            seed=seed,
            engine="reference",
        )
        for v in (0.05, 0.1)
        for seed in range(1, 6)
    ]
    return [(scene, Row.of(collide(scene))) for scene in scenes]


def test_the_mean_over_seeds_has_its_error_and_bands(
    warm_collisions, tmp_path, monkeypatch, chaincor
):
    from chaincor.analysis.figures import store_plots

    drawn = {}
    original = store_plots.plot_means

    def keep(curves, *names, **options):
        drawn.update(curves, axes=original(curves, *names, **options))
        return drawn["axes"]

    monkeypatch.setattr(store_plots, "plot_means", keep)
    path = tmp_path / "warm.sqlite"
    with Store(path) as store:
        store.record(warm_collisions)
    assert chaincor("plot", path, "--x", "velocity", "--mean", "seed")[0] == 0
    places, found = drawn[""]
    assert places == [0.05, 0.1]
    etas = [row.restitution for _, row in warm_collisions]
    for distribution, group in zip(found, (etas[:5], etas[5:]), strict=True):
        assert distribution.mean == pytest.approx(np.mean(group), rel=1e-12)
        assert distribution.standard_error == pytest.approx(np.std(group, ddof=1) / 5**0.5)
    assert len(drawn["axes"].collections) == 3, "two bands, and the bars"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--mean", "temperature"), "do not differ in temperature, the column of --mean"),
        (("--mean", "velocity"), "do not differ in velocity, the column of --mean"),
        (("--mean", "particles", "--x", "contacts"), "is a result of the collision"),
        (("--mean", "particles", "--colour", "contacts"), "--mean averages along curves"),
        (("--by", "particles", "--colour", "contacts"), "--by draws curves and --colour"),
    ],
)
def test_means_that_make_no_sense_are_refused_by_name(plot, options, message):
    chosen = options if "--x" in options else ("--x", "velocity", *options)
    status, error, _ = plot(*chosen)
    assert status == 2
    assert message in error
