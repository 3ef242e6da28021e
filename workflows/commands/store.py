"""Implement ``chaincor store``: merge and export stores."""

from pathlib import Path

import click

from chaincor.workflows.commands.options import ONE_OR_MORE, PATH, option, say


@click.group()
def store() -> None:
    """Merge stores, or export them to CSV, Parquet or an RO-Crate."""


@store.command()
@click.argument("target", metavar="TARGET", type=PATH)
@click.argument("sources", metavar="STORE...", nargs=-1, required=True, type=PATH)
def merge(target: Path, sources: tuple[Path, ...]) -> None:
    """
    Copy the rows of the STOREs into TARGET, which is created if it does not exist.

    A STORE may be a folder of shards. If TARGET and a STORE have a row for the same collision, the
    row with the smaller error is kept. The STOREs are not changed.
    """
    from chaincor.workflows.store.merge import merge_stores
    from chaincor.workflows.store.store_set import find_stores

    merged = merge_stores(target, find_stores(sources))
    say(f"{target}: {merged}")


@store.command()
@click.argument("sources", metavar="STORE...", nargs=-1, required=True, type=PATH)
@click.argument("target", metavar="FILE", type=PATH)
@option("--rows-per-file N", "FILE is a new folder for files of at most N rows", ONE_OR_MORE)
@option(
    "--rocrate",
    "write FILE as a folder with results.csv and a description for archives (RO-Crate 1.1)",
    name="as_crate",
)
def export(
    sources: tuple[Path, ...], target: Path, rows_per_file: int | None, as_crate: bool
) -> None:
    """Write all rows of the STOREs to FILE, as .csv, or as .parquet with chaincor[export]."""
    from chaincor.workflows.outputs import refuse_overwriting_inputs
    from chaincor.workflows.store.export import export_crate, export_store
    from chaincor.workflows.store.store_set import find_stores, open_stores

    if as_crate and rows_per_file is not None:
        raise click.UsageError(
            "--rows-per-file is for .csv and .parquet, not for --rocrate. Leave out --rows-per-file"
        )
    refuse_overwriting_inputs(target, find_stores(sources), "FILE")
    with open_stores(sources) as opened:
        rows = (
            export_crate(opened, target)
            if as_crate
            else export_store(opened, target, rows_per_file)
        )
        say(f"{target}: {rows} rows")
