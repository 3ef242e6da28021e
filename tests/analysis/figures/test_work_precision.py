"""Figures of the study of accuracy: what is drawn is what was measured, and nothing covers it."""

import numpy as np
import pytest

from chaincor.analysis.figures.work_precision import (
    TableCurve,
    WorkPrecisionCurve,
    plot_error_budget,
    plot_table_errors,
    plot_work_precision,
)


def curve(label, group, errors):
    return WorkPrecisionCurve(
        label=label, group=group, scheme="order8", dashed=False, seconds=[0.1, 0.2],
        errors=errors, lowest=[0.5 * e for e in errors], highest=[2.0 * e for e in errors],
    )  # fmt: skip


def legend_box(figure):
    figure.canvas.draw()
    (legend,) = figure.legends
    return legend.get_window_extent()


def test_work_precision_shows_errors_bars_and_front():
    curves = [curve("LAMMPS", "lammps", [1e-3, 1e-6]), curve("stock", "stock wall", [1e-3, 1e-4])]
    ax = plot_work_precision(curves, front=([0.1, 0.2], [1e-3, 1e-6]), floor=1e-12)
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    points, _, (bars,) = ax.containers[0]
    np.testing.assert_allclose(points.get_ydata(), [1e-3, 1e-6])
    np.testing.assert_allclose(bars.get_segments()[0][:, 1], [0.5e-3, 2e-3])
    labels = [text.get_text() for text in ax.figure.legends[0].get_texts()]
    assert labels == ["Pareto front of LAMMPS", "LAMMPS", "stock"]
    assert legend_box(ax.figure).x0 >= ax.get_window_extent().x1


def test_an_error_of_zero_has_a_place():
    ax = plot_work_precision([curve("exact", "reference", [1e-3, 0.0])], front=([], []))
    assert 0.0 < ax.containers[0][0].get_ydata()[1] < 1e-15


def test_budget_bars_end_at_the_errors_and_say_where_there_is_none():
    budgets = {
        "advised": {"wall": None, "integrator": 1e-8, "table": 0.0},
        "stock": {"wall": 2e-4, "integrator": 2e-7, "table": 1e-12},
    }
    ax = plot_error_budget(budgets, {"advised": 1e-8, "stock": 2e-4})
    tops = [bar.get_y() + bar.get_height() for bar in ax.patches if bar.get_height() > 0.0]
    assert sorted(tops) == pytest.approx([1e-12, 1e-8, 2e-7, 2e-4])
    texts = [text.get_text() for text in ax.texts]
    assert "none" in texts
    assert "0" in texts
    assert "2e-04" in texts
    assert legend_box(ax.figure).x0 >= ax.get_window_extent().x1


def test_tables_of_each_style_and_range_have_a_line():
    curves = [
        TableCurve(style, name, [100, 1000], [1e-4, 1e-6])
        for style in ("linear", "spline")
        for name in ("scene", "wide")
    ]
    ax = plot_table_errors(curves)
    assert len({(line.get_color(), line.get_linestyle()) for line in ax.get_lines()}) == 4
