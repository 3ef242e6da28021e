"""Implement ``chaincor store``: merge and export stores."""

from pathlib import Path

import click

from chaincor.workflows.commands.options import PATH, option, say


@click.group()
def store() -> None:
    """Merge stores, or export one to CSV, Parquet or an RO-Crate."""


@store.command()
@click.argument("target", metavar="TARGET", type=PATH)
@click.argument("sources", metavar="STORE...", nargs=-1, required=True, type=PATH)
def merge(target: Path, sources: tuple[Path, ...]) -> None:
    """
    Copy the rows of the STOREs into TARGET, which is created if it does not exist.

    If both have a row for the same collision, the row with the smaller error is kept. The STOREs
    are not changed.
    """
    from chaincor.workflows.store.merge import merge_stores

    merged = merge_stores(target, list(sources))
    say(f"{target}: {merged}")


@store.command()
@click.argument("source", metavar="STORE", type=PATH)
@click.argument("target", metavar="FILE", type=PATH)
@option(
    "--rocrate",
    "write FILE as a folder with results.csv and a description for archives (RO-Crate 1.1)",
    name="as_crate",
)
def export(source: Path, target: Path, as_crate: bool) -> None:
    """Write all rows of STORE to FILE, as .csv, or as .parquet with chaincor[export]."""
    from chaincor.workflows.outputs import refuse_overwriting_inputs
    from chaincor.workflows.store.export import export_crate, export_store
    from chaincor.workflows.store.results_store import Store

    refuse_overwriting_inputs(target, [source], "FILE")
    with Store(source, read_only=True) as opened:
        rows = (export_crate if as_crate else export_store)(opened, target)
        say(f"{target}: {rows} rows")
