"""``chaincor plot``: curves and heat maps straight from a store."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from workflows.errors import StoreError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from workflows.store import Store


@click.command()
@click.argument("store_path", metavar="STORE", type=click.Path(path_type=Path))
@click.option("--x", default="speed", help="column along the axis [default: speed]")
@click.option("--y", default="restitution", help="column up the axis [default: restitution]")
@click.option("--by", help="one curve for each value of this column")
@click.option("--colour", help="a heat map: this column as colour over x and y")
@click.option("--where", multiple=True, metavar="COND", help="such as potential=lj or speed<0.5")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="PNG, PDF or SVG [default: the store's name with .png]",
)
def plot(
    store_path: Path,
    x: str,
    y: str,
    by: str | None,
    colour: str | None,
    where: tuple[str, ...],
    output: Path | None,
) -> None:
    """Draw curves or a heat map from a store."""
    from analysis.atomic_write import written_aside
    from workflows.store import Store

    if by is not None and colour is not None:
        raise click.UsageError("--by makes curves and --colour a heat map; give one")
    with Store(store_path, read_only=True) as store:
        if colour is not None:
            figure = _heat_map(store, x, y, colour, where)
        else:
            figure = _curves(store, x, y, by, where)
    target = output or store_path.with_suffix(".png")
    if target.suffix not in (".png", ".pdf", ".svg"):
        raise click.UsageError(f"'{target}' ends in '{target.suffix}'; expected .png, .pdf or .svg")
    with written_aside(target) as aside:
        figure.savefig(aside)
    click.echo(target)


def _numbers(store: "Store", names: tuple[str, ...], where: tuple[str, ...]) -> list[Any]:
    """Return the rows in which all columns have a value, the first ones as numbers."""
    from workflows.store_query import query_rows

    rows = query_rows(store, names, where=[*where, *(f"{name}!=" for name in names)])
    if not rows:
        raise StoreError(
            f"no row of {store.path} has {' and '.join(names)}"
            f"{' where ' + ', '.join(where) if where else ''}; see `chaincor show`"
        )
    for name, value in zip(names[:2], rows[0], strict=False):
        if not isinstance(value, int | float):
            raise StoreError(f"column '{name}' holds {value!r}; expected numbers along an axis")
    return rows


def _curves(store: "Store", x: str, y: str, by: str | None, where: tuple[str, ...]) -> "Figure":
    from analysis.figures.store_plots import plot_curves

    names = (x, y) if by is None else (x, y, by)
    curves: dict[str, tuple[list[float], list[float]]] = {}
    for first, second, *label in _numbers(store, names, where):
        name = f"{by} = {label[0]}" if label else ""
        xs, ys = curves.setdefault(name, ([], []))
        xs.append(first)
        ys.append(second)
    return plot_curves(curves, x, y).figure  # type: ignore[return-value]


def _heat_map(store: "Store", x: str, y: str, colour: str, where: tuple[str, ...]) -> "Figure":
    from analysis.figures.store_plots import plot_heat_map

    rows = _numbers(store, (x, y, colour), where)
    return plot_heat_map(*zip(*rows, strict=True), labels=(x, y, colour)).figure  # type: ignore
