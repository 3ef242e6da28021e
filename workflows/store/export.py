"""Export a store to CSV, Parquet, pandas or an RO-Crate."""

import csv
import json
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chaincor.analysis.atomic_write import written_aside
from chaincor.analysis.observables import OBSERVABLES
from chaincor.analysis.output_paths import judge_output
from chaincor.lammps_inputs.bonds.potentials import WHOLE_KEYS
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.errors import StoreError
from chaincor.workflows.outputs import make_folder
from chaincor.workflows.research_object import METADATA_FILE, describe_folder, require_rocrate
from chaincor.workflows.store.checked_rows import check_rows
from chaincor.workflows.store.query import query_rows
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.schema import FLAG_COLUMNS, PLAIN_COLUMNS
from chaincor.workflows.terminal_text import csv_cell

if TYPE_CHECKING:
    import pandas


def export_store(store: Store, path: Path) -> int:
    """
    Write all rows to ``.csv`` or ``.parquet``, and return their number.

    Rows are sorted by potential, particles and velocity. The file appears when it is complete.
    Raises StoreError for another file extension, or if the libraries for Parquet are missing.
    Raises InputError if the file exists and is not an earlier export.
    """
    if path.suffix not in (".csv", ".parquet"):
        raise StoreError(
            f"'{path.name}' ends in '{path.suffix}'. Give a name that ends in .csv or .parquet"
        )
    kind = "results" if path.suffix == ".csv" else path.suffix
    judge_output(path, kind)
    rows = _rows(store)
    with written_aside(path, kind) as aside:
        if path.suffix == ".csv":
            with aside.open("w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerows([PLAIN_COLUMNS, *(map(csv_cell, row) for row in rows)])
        else:
            try:
                _frame(rows).to_parquet(aside, index=False)
            except ImportError:
                raise StoreError(
                    "Parquet needs pandas and pyarrow. Install them: pip install chaincor[export]"
                ) from None
    return len(rows)


def export_crate(store: Store, folder: Path) -> int:
    """
    Write all rows to ``results.csv`` in an RO-Crate folder, and return their number.

    Raises MissingLibraryError without the library rocrate. Raises InputError if the folder holds
    something other than an earlier export.
    """
    require_rocrate()
    table = folder / "results.csv"
    if (folder / METADATA_FILE).exists() and not table.exists():
        raise InputError(
            f"{str(folder)!r} is an RO-Crate of other data. Give a new folder, or the "
            "folder of an earlier export"
        )
    make_folder(folder)
    rows = export_store(store, table)
    known = store.select("SELECT versions, id FROM environments")[1]
    check_rows(store.path, ["versions"], known, [f"environment {number}" for _, number in known])
    describe_folder(
        folder,
        f"{rows} collisions of one-dimensional chains, computed by chaincor",
        {table.name: "One row a collision: what collides, what came out, and how."},
        sorted({pair for text, _ in known for pair in json.loads(text).items()}),
        {name: _meaning(name) for name in PLAIN_COLUMNS},
    )
    return rows


def _meaning(column: str) -> str:
    known = OBSERVABLES.get(column)
    return column.replace("_", " ") if known is None else known.meaning


def to_pandas(store: Store | Path | str) -> "pandas.DataFrame":
    """
    Return all rows as a data frame.

    Parameters
    ----------
    store : Store or pathlib.Path or str
        The store, or its file.

    Returns
    -------
    pandas.DataFrame
        One row for each collision, with the columns of ``chaincor show``.

    Raises
    ------
    StoreError
        If pandas is missing, or the file is not a store.

    Examples
    --------
    >>> from chaincor import Scene, collide, to_pandas
    >>> rows = collide([Scene(particles=5, engine="reference")], store="five.sqlite")
    >>> to_pandas("five.sqlite")[["particles", "contacts"]].values.tolist()
    [[5, 4]]
    """
    with nullcontext(store) if isinstance(store, Store) else Store(store, read_only=True) as opened:
        return _frame(_rows(opened))


def _frame(rows: list[tuple]) -> "pandas.DataFrame":
    frame = require_pandas().DataFrame.from_records(rows, columns=list(PLAIN_COLUMNS))
    names = ("contacts", "fragments", *WHOLE_KEYS, "table_points", "target_particles")
    whole = dict.fromkeys(names, "Int64")
    return frame.astype(whole | dict.fromkeys(FLAG_COLUMNS, "boolean"))


def require_pandas() -> Any:
    """Import and return pandas. Raises StoreError if it is missing."""
    try:
        import pandas as pd
    except ImportError:
        raise StoreError("pandas is not installed. Install it: pip install pandas") from None
    return pd


def _rows(store: Store) -> list[tuple]:
    return query_rows(store, PLAIN_COLUMNS, order=("potential", "particles", "velocity"))
