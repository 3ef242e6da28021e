"""Plot a quantity from many collisions against one or two other quantities."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.distribution import Distribution
from chaincor.analysis.figures.style import choose_axes, legend_above, look
from chaincor.analysis.observables import OBSERVABLES
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import number_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# An axis is logarithmic if its largest value divided by its smallest exceeds this ratio.
_WIDE = 30.0
# Curves with more points are drawn without markers. Figures with more curves have no legend.
_MANY_POINTS = 200
_MANY_CURVES = 24
# Width of a legend in letters, and height of its rows in inches.
_LEGEND_WIDTH = 66
_LEGEND_ROW = 0.19


def plot_curves(
    curves: Mapping[str, tuple[ArrayLike, ArrayLike]],
    x_name: str,
    y_name: str,
    *,
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw one curve for each name, through the points in the given order.

    `curves` maps names to (x, y), two arrays of shape (points,). A curve with an empty name has no
    entry in the legend. `x_name` and `y_name` are columns of a store or fields of a result, and
    label the axes. The x axis is logarithmic if values span more than a factor of 30. If there are
    more than 24 curves, there is no legend. If the names of the curves are values of one quantity,
    a colour bar shows these values; otherwise the title gives the number of curves. Returns the
    axes; without `ax`, they are those of a new figure.
    """
    own = ax is None
    ax = choose_axes(ax)
    every_x = np.concatenate([np.asarray(x, dtype=float) for x, _ in curves.values()])
    ordered = sorted(curves.items(), key=_natural)
    shades = _shades(ax, [label for label, _ in ordered]) if len(ordered) > _MANY_CURVES else None
    for number, (label, (x, y)) in enumerate(ordered):
        few = len(np.asarray(y)) <= _MANY_POINTS
        drawn: dict[str, Any] = look(number)
        if shades is not None:
            drawn |= {"color": shades[number], "linestyle": "-"}
        if not few:
            drawn["marker"] = ","
        drawn |= {"markersize": 4.0 if few else 1.0, "rasterized": not few, "label": label or None}
        ax.plot(x, y, **drawn, linewidth=1.1)
    if _is_wide(every_x):
        ax.set_xscale("log")
    ax.set(xlabel=_label(x_name), ylabel=_label(y_name))
    labels = [label for label in curves if label]
    if 1 <= len(labels) <= _MANY_CURVES:
        columns = max(1, min(3, _LEGEND_WIDTH // max(map(len, labels))))
        legend_above(ax, columns)
        if own:  # the legend must not shrink the curves
            rows = -(-len(labels) // columns)
            ax.figure.set_figheight(ax.figure.get_figheight() + _LEGEND_ROW * rows)  # type: ignore[union-attr]
    elif labels and shades is None:
        ax.set_title(f"{len(labels)} curves, too many for a legend", loc="right")
    return ax


def _shades(ax: "Axes", labels: Sequence[str]) -> Array | None:
    """Return a colour for each label like ``particles = 10``, and draw a colour bar."""
    keys = [_natural((label, None)) for label in labels]
    names = {name for name, _ in keys}
    if len(names) > 1 or not all(" = " in label for label in labels):
        return None
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize

    values = np.array([value for _, value in keys])
    if not np.all(np.isfinite(values)):
        return None
    norm = (LogNorm if _is_wide(values) else Normalize)(np.min(values), np.max(values))
    colours = ScalarMappable(norm, cmap="viridis")
    bar = ax.figure.colorbar(colours, ax=ax, pad=0.02)
    (name,) = names
    bar.set_label(_label(name))
    return colours.to_rgba(values)


def plot_means(
    curves: Mapping[str, tuple[Sequence[float], Sequence[Distribution]]],
    x_name: str,
    y_name: str,
    *,
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw the mean and the scatter of many collisions at each point of a curve.

    `curves` maps names to x values and to the distribution at each x value. Error bars of the mean
    show its standard error. One band lies between the quartiles, the other between the 5 and 95 %
    quantiles. Returns the axes, like :func:`plot_curves`.
    """
    means = {
        label: (x, [found.mean for found in distributions])
        for label, (x, distributions) in curves.items()
    }
    ax = plot_curves(means, x_name, y_name, ax=ax)
    lines = ax.get_lines()[-len(curves) :]
    ordered = sorted(curves.items(), key=_natural)
    for line, (_, (x, distributions)) in zip(lines, ordered, strict=True):
        colour = line.get_color()
        for outer, strength in ((0, 0.12), (1, 0.2)):
            low, high = (
                [found.quantiles[place].value for found in distributions]
                for place in (outer, -1 - outer)
            )
            ax.fill_between(x, low, high, color=colour, alpha=strength, linewidth=0.0)
        mean = [found.mean for found in distributions]
        errors = [found.standard_error for found in distributions]
        ax.errorbar(x, mean, errors, fmt="none", ecolor=colour, capsize=2.0, linewidth=1.1)
    ax.set_ylabel(f"mean {ax.get_ylabel()}")
    return ax


def plot_heat_map(
    x: Sequence[float],
    y: Sequence[float],
    colour: Sequence[float],
    *,
    labels: tuple[str, str, str],
    ax: "Axes | None" = None,
) -> "Axes":
    """
    Draw a quantity as a colour against two other quantities.

    Each cell shows one collision or is empty. `labels` name the three columns. Axes are logarithmic
    if values span more than a factor of 30. Raises InputError if two collisions belong to the same
    cell.
    """
    ax = choose_axes(ax)
    columns, at_column = np.unique(np.asarray(x, dtype=float), return_inverse=True)
    rows, at_row = np.unique(np.asarray(y, dtype=float), return_inverse=True)
    places = np.ma.masked_all((len(rows), len(columns)))
    if len({*zip(at_row.tolist(), at_column.tolist(), strict=True)}) < at_row.size:
        raise InputError(
            f"several collisions have the same {labels[0]} and {labels[1]}. Choose one of them"
        )
    places[at_row, at_column] = np.asarray(colour, dtype=float)
    mesh = ax.pcolormesh(_edges(columns), _edges(rows), places, cmap="viridis", rasterized=True)
    if _is_wide(columns):
        ax.set_xscale("log")
    if _is_wide(rows):
        ax.set_yscale("log")
    ax.grid(visible=False)
    ax.set(xlabel=_label(labels[0]), ylabel=_label(labels[1]))
    ax.figure.colorbar(mesh, ax=ax, pad=0.02).set_label(_label(labels[2]))
    return ax


def _label(name: str) -> str:
    known = OBSERVABLES.get(name)
    return known.axis if known and known.axis else name.replace("_", " ")


def _is_wide(values: Array) -> bool:
    return bool(np.min(values) > 0.0 and np.max(values) > _WIDE * np.min(values))


def _edges(places: Array) -> Array:
    """Return the borders of cells, half-way between values on the scale of the axis."""
    if len(places) == 1:
        return places[0] + 0.5 * np.array([-1.0, 1.0]) * (abs(places[0]) or 1.0)
    if _is_wide(places):
        return np.exp(_edges_between(np.log(places)))
    return _edges_between(places)


def _edges_between(places: Array) -> Array:
    middle = 0.5 * (places[1:] + places[:-1])
    first, last = 2.0 * places[0] - middle[0], 2.0 * places[-1] - middle[-1]
    return np.concatenate([[first], middle, [last]])


def _natural(item: tuple[str, object]) -> tuple[str, float]:
    """Return a key that sorts labels like ``particles = 10`` by value."""
    name, _, value = item[0].rpartition(" = ")
    number = number_in(value)
    return (item[0], 0.0) if number is None else (name, number)
