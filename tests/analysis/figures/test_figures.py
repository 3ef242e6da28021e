import math
import shutil

import numpy as np
import pytest
from PIL import Image

from chaincor.analysis.figures.animation import _stage, animate_collision
from chaincor.analysis.figures.modes import plot_mode_heat_map, plot_spectrum
from chaincor.analysis.figures.store_plots import plot_curves
from chaincor.analysis.figures.style import CYCLE, new_figure
from chaincor.analysis.figures.time_series import (
    plot_bond_lengths,
    plot_contact_intervals,
    plot_contact_speeds,
    plot_energy_partition,
)
from chaincor.analysis.figures.trajectories import plot_trajectories
from chaincor.analysis.modes import mode_energies
from chaincor.lammps_inputs.errors import InputError


@pytest.fixture(scope="module")
def motion(harmonic20):
    times = np.arange(-5.0, 60.0, 0.5)
    u, v = map(np.array, zip(*(harmonic20.state(t) for t in times), strict=True))
    return times, u, v


def draw(name, motion, collision, ax=None):
    times, u, v = motion
    energy = 0.5 * 20 * 0.1**2
    modes = mode_energies(u, v)
    return {
        "trajectories": lambda: plot_trajectories(
            times, u, contact_times=collision.contact_times, ax=ax
        ),
        "intervals": lambda: plot_contact_intervals(collision.contact_times, ax=ax),
        "speeds": lambda: plot_contact_speeds(collision.contact_speeds, 0.1, ax=ax),
        "energy": lambda: plot_energy_partition(
            times, modes[:, 0], modes[:, 1:].sum(axis=1), energy, last_contact=36.8, ax=ax
        ),
        "heat map": lambda: plot_mode_heat_map(times, modes, energy, last_contact=36.8, ax=ax),
        "spectrum": lambda: plot_spectrum(modes[-1], energy, theory=modes[-1][1:], ax=ax),
        "bonds": lambda: plot_bond_lengths(
            times, 1 + np.diff(u).min(axis=1), 1 + np.diff(u).max(axis=1), ax=ax
        ),
        "restitution": lambda: plot_curves(
            {"lj": ([0.1, 1.0], [0.9, 0.7])}, "speed", "restitution", ax=ax
        ),
    }[name]()


NAMES = [
    "trajectories",
    "intervals",
    "speeds",
    "energy",
    "heat map",
    "spectrum",
    "bonds",
    "restitution",
]


@pytest.mark.parametrize("name", NAMES)
def test_a_figure_draws_into_the_axes_it_is_given_and_labels_them(name, motion, harmonic20):
    figure, ax = new_figure()
    assert draw(name, motion, harmonic20, ax) is ax
    assert ax.get_xlabel()
    assert ax.get_ylabel()
    figure.canvas.draw()
    legend = ax.get_legend()
    if legend is not None:
        # The legend is above the panel, where there are no data.
        panel = ax.get_window_extent()
        assert legend.get_window_extent().y0 >= panel.y1 - 1.0
    assert draw(name, motion, harmonic20).figure is not figure


def test_trajectories_show_the_positions(motion, harmonic20):
    times, u, _ = motion
    ax = plot_trajectories(times, u, contact_times=harmonic20.contact_times, magnification=1.0)
    lines = {line.get_label(): line for line in ax.get_lines()}
    shown = times <= 1.15 * harmonic20.contact_times[-1]
    np.testing.assert_allclose(lines["particle 1"].get_ydata(), u[shown, 0])
    np.testing.assert_array_equal(lines["contacts"].get_xdata(), harmonic20.contact_times)
    # Sound reaches the last particle after n - 1 time units.
    x, y = lines["sound, small waves"].get_data()
    far = np.argmin(np.abs(x - 19.0))
    assert y[far] == pytest.approx(19.0 + harmonic20.state(19.0)[0][-1], abs=0.1)


def test_magnification_keeps_the_order_of_the_lines(motion):
    times, u, _ = motion
    ax = plot_trajectories(times, 0.01 * u)
    assert "magnified" in ax.get_ylabel()
    grey = np.array([line.get_ydata() for line in ax.get_lines()[:20]])
    assert np.all(np.diff(grey, axis=0) > 0.0)


def test_colours_are_those_that_everyone_can_tell_apart():
    curves = {str(k): ([1.0, 2.0], [0.5, 0.6]) for k in range(7)}
    ax = plot_curves(curves, "speed", "restitution")
    assert [line.get_color() for line in ax.get_lines()] == list(CYCLE)


@pytest.mark.parametrize("points", [2, 300], ids=["with markers", "too many for markers"])
def test_of_curves_with_a_legend_no_two_look_alike(points):
    x = np.linspace(1.0, 2.0, points)
    ax = plot_curves({f"n = {k}": (x, x + k) for k in range(24)}, "speed", "restitution")
    lines = ax.get_lines()
    looks = {(line.get_color(), line.get_linestyle()) for line in lines}
    assert len(ax.get_legend().get_texts()) == len(looks) == 24
    marked = {(line.get_color(), line.get_marker()) for line in lines}
    assert len(marked) == (24 if points == 2 else 7)


def test_very_many_curves_have_a_bar_of_colours_or_say_that_they_have_no_legend():
    curves = {f"particles = {k}": ([1.0, 2.0], [0.5, k]) for k in range(2, 42)}
    ax = plot_curves(curves, "speed", "restitution")
    assert len({tuple(line.get_color()) for line in ax.get_lines()}) == 40
    (bar,) = [other for other in ax.figure.axes if other is not ax]
    assert "number of particles" in bar.get_ylabel()
    named = {
        f"bond = {'ab'[k % 2]}, {label}": curve for k, (label, curve) in enumerate(curves.items())
    }
    ax = plot_curves(named, "speed", "restitution")
    assert ax.get_title(loc="right") == "40 curves, too many for a legend"
    looks = {(x.get_color(), x.get_linestyle(), x.get_marker()) for x in ax.get_lines()}
    assert len(looks) == 40


def test_a_common_factor_is_in_the_label_and_not_over_the_legend():
    curves = {f"n = {k}": ([1.0, 2.0], [1e-7, 3e-7 * k]) for k in (1, 2)}
    ax = plot_curves(curves, "speed", "restitution_error")
    for _ in range(2):  # two drawings, one warning
        ax.figure.canvas.draw()
        assert ax.yaxis.get_offset_text().get_text() == ""
        assert ax.get_ylabel().count("10^{") == 1
    ax.set_ylabel("another")
    ax.figure.canvas.draw()
    assert ax.get_ylabel().startswith("another (")


@pytest.mark.slow
def test_animation_is_a_gif_that_moves(motion, tmp_path):
    times, u, v = motion
    path = animate_collision(times, u, v, tmp_path / "c.gif", impact_velocity=0.1, frames=6)
    with Image.open(path) as image:
        assert image.n_frames == 6
        first = np.asarray(image.convert("RGB"))
        image.seek(5)
        assert np.any(first != np.asarray(image.convert("RGB")))


def test_springs_join_particles_of_one_body_and_legends_say_the_colours():
    x = np.array([[-1.0, 0.0, 0.5, 1.5, 9.0]])
    figure, draw = _stage(x, np.zeros((1, 5)), np.zeros(1), "", targets=2)
    draw(0)
    along = figure.axes[1].get_lines()[0].get_xdata().reshape(4, -1)
    # No line is drawn across the contact or where the bond broke.
    assert [bool(np.isfinite(bond).all()) for bond in along] == [True, False, True, False]
    np.testing.assert_allclose(along[0][[0, -1]], [-1.0, 0.0])
    (legend,) = figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert words == ["moving to the target", "at rest", "moving away"]


def test_animation_refuses_what_it_cannot_write(motion, tmp_path, monkeypatch):
    times, u, v = motion
    with pytest.raises(InputError, match=r"\.gif or \.mp4"):
        animate_collision(times, u, v, tmp_path / "c.avi", impact_velocity=0.1)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(InputError, match="needs ffmpeg"):
        animate_collision(times, u, v, tmp_path / "c.mp4", impact_velocity=0.1)


@pytest.mark.parametrize("frames", [0, -3, 2.5, math.nan, "many", None, True, 10**12])
def test_a_number_of_pictures_that_is_none_is_refused_and_leaves_no_file(motion, tmp_path, frames):
    said = rf"^the number of pictures is {frames!r}\. Give a whole number, from 1 to"
    times, u, v = motion
    with pytest.raises(InputError, match=said):
        animate_collision(times, u, v, tmp_path / "c.gif", impact_velocity=0.1, frames=frames)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("magnification", [math.nan, math.inf, -1.0, 0.0, "big", True])
def test_a_magnification_that_is_none_is_refused(motion, magnification):
    times, u, _ = motion
    said = rf"^magnification is {magnification!r}\. Give a positive finite number"
    with pytest.raises(InputError, match=said):
        plot_trajectories(times, u, magnification=magnification)


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="MP4 is written where ffmpeg is")
def test_animation_as_mp4(motion, tmp_path):
    times, u, v = motion
    path = animate_collision(times, u, v, tmp_path / "c.mp4", impact_velocity=0.1, frames=3)
    assert path.read_bytes()[4:8] == b"ftyp"
