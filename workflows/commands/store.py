"""``chaincor store``: merging and exporting stores."""

from pathlib import Path

import click

_PATH = click.Path(path_type=Path)


@click.group()
def store() -> None:
    """Merge stores, or export one to CSV or Parquet."""


@store.command()
@click.argument("target", metavar="TARGET", type=_PATH)
@click.argument("sources", metavar="STORE...", nargs=-1, required=True, type=_PATH)
@click.pass_context
def merge(ctx: click.Context, target: Path, sources: tuple[Path, ...]) -> None:
    """
    Copy the rows of the STOREs into TARGET, which is made if it is not there.

    Where both have a row, the result with the smaller error stays. The STOREs are not changed.
    Damaged rows are named and not copied; the exit status is then 1.
    """
    from chaincor.workflows.store.damage import tell_damage
    from chaincor.workflows.store.merge import merge_stores
    from chaincor.workflows.store.results_store import Store

    rows = merge_stores(target, list(sources))
    click.echo(f"{target}: {rows} rows")
    damaged = []
    for source in (target, *sources):
        with Store(source, read_only=True) as opened:
            damaged.append(tell_damage(opened))
    _leave(ctx, *damaged)


@store.command()
@click.argument("source", metavar="STORE", type=_PATH)
@click.argument("target", metavar="FILE", type=_PATH)
@click.pass_context
def export(ctx: click.Context, source: Path, target: Path) -> None:
    """
    Write all rows of STORE to FILE: .csv, or .parquet with chaincor[export].

    Damaged rows are named and left out; the exit status is then 1.
    """
    from chaincor.workflows.outputs import refuse_overwriting_inputs
    from chaincor.workflows.store.damage import tell_damage
    from chaincor.workflows.store.export import export_store
    from chaincor.workflows.store.results_store import Store

    refuse_overwriting_inputs(target, [source], "FILE")
    with Store(source, read_only=True) as opened:
        rows = export_store(opened, target)
        click.echo(f"{target}: {rows} rows")
        _leave(ctx, tell_damage(opened))


def _leave(ctx: click.Context, *damaged: str | None) -> None:
    """Say what was left out; the exit status is 1 if anything was."""
    told = [line for line in damaged if line is not None]
    for line in told:
        click.echo(f"chaincor: {line}", err=True)
    if told:
        ctx.exit(1)
