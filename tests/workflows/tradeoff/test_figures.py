"""Test that figures of the study show the measured values, and that nothing covers the values."""

import numpy as np
import pytest

from chaincor.workflows.tradeoff.budget import ErrorBudget, TablePoint
from chaincor.workflows.tradeoff.figures import (
    plot_error_budget,
    plot_table_errors,
    plot_work_precision,
)
from chaincor.workflows.tradeoff.reference_solution import Deviation
from chaincor.workflows.tradeoff.settings import Measurement, Setting


def measured(series, *errors):
    """Return a measurement for each error, with two runs that have this rms error."""
    return [
        Measurement(
            Setting(*series, 1.0 / (k + 1)),
            [Deviation(part * error, 0.0, 0.0) for part in (0.5, 1.75**0.5)],
            seconds=[0.1 * (k + 1)] * 2,
        )
        for k, error in enumerate(errors)
    ]


def budget(name, total, **parts):
    causes = dict.fromkeys(("wall", "integrator", "table", "rounding")) | {"output": 0.0} | parts
    return ErrorBudget(name, "order8", 0.1, **causes, output_exact=0.0, total=total,
                       exact_restitution=None)  # fmt: skip


def legend_box(figure):
    figure.canvas.draw()
    (legend,) = figure.legends
    return legend.get_window_extent()


def test_work_precision_shows_errors_bars_and_front():
    lammps = measured(("lammps", "event", "order8", "spline"), 1e-3, 1e-6)
    stock = measured(("lammps", "reflect", "verlet", "spline"), 1e-3, 1e-4)
    ax = plot_work_precision([*lammps, *stock], floor=1e-12)
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    np.testing.assert_allclose(ax.get_lines()[0].get_ydata(), [1e-3, 1e-6])
    points, _, (bars,) = ax.containers[0]
    np.testing.assert_allclose(points.get_ydata(), [1e-3, 1e-6])
    np.testing.assert_allclose(bars.get_segments()[0][:, 1], [0.5e-3, 1.75**0.5 * 1e-3])
    labels = [text.get_text() for text in ax.figure.legends[0].get_texts()]
    named = ["LAMMPS, event wall, order8", "LAMMPS, stock wall, verlet"]
    assert labels == ["Pareto front of LAMMPS", *named]
    assert legend_box(ax.figure).x0 >= ax.get_window_extent().x1


def test_an_error_of_zero_has_a_place():
    exact = measured(("reference", "event", "order8", None), 1e-3, 0.0)
    ax = plot_work_precision(exact)
    assert 0.0 < ax.containers[0][0].get_ydata()[1] < 1e-15


def test_budget_bars_end_at_the_errors_and_say_where_there_is_none():
    ax = plot_error_budget(
        [
            budget("advised", 1e-8, integrator=1e-8, table=0.0),
            budget("stock", 2e-4, wall=2e-4, integrator=2e-7, table=1e-12),
        ]
    )
    tops = [bar.get_y() + bar.get_height() for bar in ax.patches if bar.get_height() > 0.0]
    assert sorted(tops) == pytest.approx([1e-12, 1e-8, 2e-7, 2e-4])
    texts = [text.get_text() for text in ax.texts]
    assert "none" in texts
    assert "0" in texts
    assert "2e-04" in texts
    assert legend_box(ax.figure).x0 >= ax.get_window_extent().x1


def test_tables_of_each_style_and_range_have_a_line():
    points = [
        TablePoint(style, rows, name, 1e-3, 0.1 / rows**2)
        for style in ("linear", "spline")
        for name in ("scene", "wide")
        for rows in (100, 1000)
    ]
    ax = plot_table_errors(points)
    assert len({(line.get_color(), line.get_linestyle()) for line in ax.get_lines()}) == 4
