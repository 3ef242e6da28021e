"""Implement ``chaincor plot``: draw curves and heat maps from a store."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from chaincor.workflows.commands.options import PATH, option, say
from chaincor.workflows.errors import StoreError
from chaincor.workflows.terminal_text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from chaincor.workflows.store.results_store import Store
    from chaincor.workflows.store.store_set import StoreSet


@click.command()
@click.argument("stores", metavar="STORE...", nargs=-1, required=True, type=PATH)
@option("--x TEXT", "column on the horizontal axis [default: speed]", default="speed")
@option("--y TEXT", "column on the vertical axis [default: restitution]", default="restitution")
@option(
    "--by COL,...",
    "draw one curve for each value of these columns [default: all columns that vary]",
)
@option("--colour TEXT", "draw a heat map over x and y, coloured by this column")
@option(
    "--mean COL",
    "average over this column, such as seed; the plot shows the mean, its "
    "standard error and bands between the quantiles of 5, 25, 75 and 95 %",
)
@option(
    "--where COND", "choose rows by a condition, such as potential=lj or speed<0.5", multiple=True
)
@option("-o, --output FILE", "PNG, PDF or SVG [default: the store's name with .png]", PATH)
def plot(
    stores: tuple[Path, ...],
    x: str,
    y: str,
    by: str | None,
    colour: str | None,
    mean: str | None,
    where: tuple[str, ...],
    output: Path | None,
) -> None:
    """
    Draw curves or a heat map from stores, or from folders of shards.

    Scenes that differ in columns other than the axes belong to different curves. The command
    averages only over the column given by --mean.
    """
    from chaincor.analysis.atomic_write import written_aside
    from chaincor.analysis.output_paths import judge_output
    from chaincor.workflows.outputs import (
        PICTURES,
        PICTURES_SAID,
        refuse_overwriting_inputs,
    )
    from chaincor.workflows.store.store_set import find_stores, open_stores

    if by is not None and colour is not None:
        raise click.UsageError(
            "--by draws curves and --colour draws a heat map. Give only one of them"
        )
    if mean is not None and colour is not None:
        raise click.UsageError(
            "--mean averages along curves and --colour draws a heat map. Give only one of them"
        )
    target = output or stores[0].with_suffix(".png")
    if target.suffix not in PICTURES:
        raise click.UsageError(f"'{target}' ends in '{target.suffix}'. Give {PICTURES_SAID}")
    refuse_overwriting_inputs(
        target, find_stores(stores), "the picture" if output is None else "--output"
    )
    judge_output(target, target.suffix)
    with open_stores(stores) as store:
        if colour is not None:
            figure = _heat_map(store, x, y, colour, where)
        else:
            figure = _curves(store, x, y, by, mean, where)
    with written_aside(target) as aside:
        figure.savefig(aside)
    say(target)


# These columns contain lists. A single number of such a list can be an axis.
_LISTS = ("masses", "target_masses")
# These default values are added to scenes, because the identity of a scene omits keys with default
# values.
_ABSENT = {"contact": "hard"}
# Both columns are the impact speed, in different units.
_IMPACT = {"speed", "velocity"}
# Labels list keys in this order, with the most important keys first. A later key is omitted if it
# follows from earlier keys.
_FIRST = {"potential": -2, "particles": -1, "speed": 2, "velocity": 3}


@dataclass(frozen=True)
class _Row:
    """Scene of one collision, and the values in its requested columns."""

    values: tuple[Any, ...]
    scene: dict[str, Any]


def _rows(
    store: "Store | StoreSet",
    axes: tuple[str, ...],
    others: tuple[str, ...],
    where: tuple[str, ...],
) -> list[_Row]:
    """
    Return the rows that have a value on every axis.

    Raise StoreError if there is no such row, or if an axis has values that are no numbers.
    """
    from chaincor.workflows.store.query import ONE_MASS, query_rows

    conditions = [*where, *(f"{name}!=" for name in axes)]
    rows = query_rows(store, (*axes, *others, "speed", "scene"), where=conditions)
    if not rows:
        raise StoreError(
            f"no row of {store.path} has "
            f"{' and '.join(axes)}{' where ' + ', '.join(where) if where else ''}. "
            "List the rows with `chaincor show`"
        )
    for name, value in ((name, row[k]) for row in rows for k, name in enumerate(axes)):
        if not isinstance(value, int | float):
            hint = f": that of particle 2 is {name}.2" if name in _LISTS else ""
            raise StoreError(
                f"column '{name}' holds {value!r}, which an axis cannot show. Choose a column "
                f"of numbers{hint}"
            )
    scenes = [json.loads(scene) for *_, scene in rows]
    for name in axes:
        if one := ONE_MASS.fullmatch(name):
            _leave_out(scenes, one[1], int(one[2]))
    return [
        _Row(tuple(values), _comparable(scene) | {"speed": speed})
        for (*values, speed, _), scene in zip(rows, scenes, strict=True)
    ]


def _leave_out(scenes: list[dict[str, Any]], masses: str, particle: int) -> None:
    """
    Remove the mass that is an axis from the scenes, which can then be compared without it.

    Lists of masses repeat along the chain, and a scene stores their shortest form. For example, 1,
    1 is stored as 1. Lists are therefore expanded to the length of the chain before the mass is
    removed.
    """
    lists = [scene.get(masses, [1.0]) for scene in scenes]
    longest = max((len(given) for given in lists if isinstance(given, list)), default=1)
    for scene, given in zip(scenes, lists, strict=True):
        if isinstance(given, list):
            repeated = [given[i % len(given)] for i in range(longest)]
            fits = longest % len(given) == 0
            repeated[(particle - 1) % (longest if fits else len(given))] = None
            # If the chain is not a whole number of repetitions of a list, the length of the list is
            # appended. Lists of different lengths then remain different.
            scene[masses] = repeated if fits else [*repeated, len(given)]


def _comparable(scene: dict[str, Any]) -> dict[str, Any]:
    """Return a scene whose values can be compared and sorted, with lists as text."""
    found: dict[str, Any] = {}
    for key, value in scene.items():
        if key == "parameters":
            found |= {f"parameters.{name}": number for name, number in value.items()}
        elif isinstance(value, list):
            found[key] = ", ".join("..." if item is None else str(item) for item in value)
        else:
            found[key] = value
    return found


def _varying(rows: list[_Row], axes: tuple[str, ...]) -> list[str]:
    """Return the fewest keys, apart from the axes, that distinguish the scenes."""
    # The tolerance does not distinguish rows, because a store has one row for all tolerances of a
    # collision.
    keys = _scene_keys(rows) - {"tolerance", *axes}
    # If the axis is a result, the points on a curve differ in the impact speed.
    if _IMPACT & set(axes) or not _scene_keys(rows) & set(axes):
        keys -= _IMPACT
    if any(row.scene["speed"] is None for row in rows):
        keys.discard("speed")
    chosen: list[str] = []
    groups = 1
    for key in sorted(keys, key=lambda key: (_FIRST.get(key, 1), key)):
        finer = len({tuple(row.scene.get(name) for name in (*chosen, key)) for row in rows})
        if finer > groups:
            chosen, groups = [*chosen, key], finer
    return chosen


def _scene_keys(rows: list[_Row]) -> set[str]:
    """Return all keys that occur in the rows' scenes."""
    return {key for row in rows for key in row.scene}


def _curves(
    store: "Store | StoreSet",
    x: str,
    y: str,
    by: str | None,
    mean: str | None,
    where: tuple[str, ...],
) -> "Figure":
    from chaincor.analysis.figures.store_plots import plot_curves

    asked = () if by is None else tuple(name.strip() for name in by.split(","))
    rows = _rows(store, (x, y), asked, where)
    given = (x,) if mean is None else (x, mean)
    if mean is not None:
        _check_mean(rows, x, mean)
    names = asked or tuple(_varying(rows, given))
    groups: dict[tuple[Any, ...], list[_Row]] = {}
    for row in rows:
        key = (
            row.values[2:]
            if asked
            else tuple(row.scene.get(name, _ABSENT.get(name)) for name in names)
        )
        groups.setdefault(key, []).append(row)
    curves = {}
    for label, group in zip(_labels(names, groups), groups.values(), strict=True):
        left = _varying(group, given)
        if left:
            raise StoreError(
                f"within a curve of --by {by}, the scenes still differ in "
                f"{_named(left, group)}. Use --by {','.join([*asked, *left])}, or "
                "choose rows with --where"
            )
        along = sorted(group, key=lambda row: (row.values[0], row.scene["velocity"]))
        if x not in along[0].scene:
            along.sort(key=lambda row: row.scene["velocity"])
        curves[label] = ([row.values[0] for row in along], [row.values[1] for row in along])
    if mean is not None:
        return _means(curves, x, y)
    return plot_curves(curves, x, y).figure  # type: ignore[return-value]


def _check_mean(rows: list[_Row], x: str, mean: str) -> None:
    keys = _scene_keys(rows)
    if mean not in keys or mean == x:
        raise StoreError(
            f"scenes at equal {x} do not differ in {mean}, the column of --mean. "
            f"Use one of {', '.join(sorted(keys - {x}))}"
        )
    if x not in keys:
        raise StoreError(
            f"--mean averages scenes with the same {x}, but {x} is a result of the "
            "collision and differs from scene to scene. Give an input of the "
            "scene, such as speed, as --x"
        )


def _means(curves: dict[str, tuple[list[Any], list[Any]]], x: str, y: str) -> "Figure":
    """Draw the mean and the quantiles at each value of x along the curves."""
    from chaincor.analysis.distribution import Distribution
    from chaincor.analysis.figures.store_plots import plot_means

    drawn = {}
    for label, (places, values) in curves.items():
        at = dict.fromkeys(places)
        found = [[v for p, v in zip(places, values, strict=True) if p == place] for place in at]
        distributions = [Distribution.of(each, [0.0] * len(each)) for each in found]
        drawn[label] = (list(at), distributions)
    return plot_means(drawn, x, y).figure  # type: ignore[return-value]


def _heat_map(
    store: "Store | StoreSet", x: str, y: str, colour: str, where: tuple[str, ...]
) -> "Figure":
    from chaincor.analysis.figures.store_plots import plot_heat_map

    rows = _rows(store, (x, y, colour), (), where)
    left = _varying(rows, (x, y))
    if left:
        raise StoreError(
            f"scenes with equal {x} and {y} differ in {_named(left, rows)}. Choose "
            "one scene for each point with --where"
        )
    values = zip(*(row.values for row in rows), strict=True)
    return plot_heat_map(*values, labels=(x, y, colour)).figure  # type: ignore


def _named(names: list[str], rows: list[_Row]) -> str:
    return " and ".join(
        f"{name} ({len({row.scene.get(name) for row in rows})} values)" for name in names
    )


def _labels(names: Sequence[str], keys: Iterable[tuple[Any, ...]]) -> list[str]:
    """Return names of curves from their values: short names, or full names if these coincide."""
    labels: list[str] = []
    for show in (_shown, str):
        values = ([_drawable(show(value)) for value in key] for key in keys)
        labels = [", ".join(map(" = ".join, zip(names, words, strict=True))) for words in values]
        if len(set(labels)) == len(labels):
            break
    return labels


def _drawable(text: str) -> str:
    """Remove characters from a text that fonts lack, and escape dollar signs."""
    return printable(text).encode("ascii", "backslashreplace").decode().replace("$", r"\$")


def _shown(value: Any) -> str:
    if value is None:
        return "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)[:24]
