"""Export a store to CSV, Parquet, pandas or an RO-Crate."""

import csv
import itertools
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin

from chaincor.analysis.atomic_write import folder_aside, written_aside
from chaincor.analysis.observables import OBSERVABLES
from chaincor.lammps_inputs.bonds.potentials import WHOLE_KEYS
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_texts import path_given
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import StoreError
from chaincor.workflows.outputs import make_folder
from chaincor.workflows.research_object import METADATA_FILE, describe_folder, require_rocrate
from chaincor.workflows.store.checked_rows import DECLARED, check_rows
from chaincor.workflows.store.query import iterate_rows
from chaincor.workflows.store.results_store import Store
from chaincor.workflows.store.schema import FLAG_COLUMNS, PLAIN_COLUMNS
from chaincor.workflows.store.store_set import StoreSet, open_stores
from chaincor.workflows.terminal_text import csv_cell

if TYPE_CHECKING:
    import pandas

_KINDS = {"TEXT": str, "INTEGER": int, "REAL": float, "int": int, "float": float, "str": str}
# Number of rows in one group of a Parquet file, and in memory at a time.
_ROW_GROUP = 100_000


def export_store(store: Store | StoreSet, path: Path, rows_per_file: int | None = None) -> int:
    """
    Write all rows to ``.csv`` or ``.parquet``, and return their number.

    Rows are sorted by potential, particles and velocity, and are not kept in memory. The file
    appears when it is complete. If `rows_per_file` is given, `path` is a new folder for files with
    at most this number of rows. Raise StoreError if the file has another extension, or if the
    library for Parquet is missing. Raise InputError if the file exists and is no earlier export, or
    if the folder exists.
    """
    if path.suffix not in (".csv", ".parquet"):
        raise StoreError(
            f"'{path.name}' ends in '{path.suffix}'. Give a name that ends in .csv or .parquet"
        )
    write = _write_csv if path.suffix == ".csv" else _parquet_writer()
    rows = _rows(store)
    if rows_per_file is None:
        kind = "results" if path.suffix == ".csv" else path.suffix
        with written_aside(path, kind) as aside:
            return write(rows, aside)
    if path.exists():
        raise InputError(
            f"{str(path)!r} exists. Give a new folder for files of {rows_per_file} rows"
        )
    count = 0
    with folder_aside(path, prefix="export") as folder:
        for number in itertools.count(1):
            part = itertools.islice(rows, rows_per_file)
            first = next(part, None)
            if first is None and number > 1:
                return count
            given = itertools.chain(() if first is None else (first,), part)
            count += write(given, folder / f"part-{number:05d}{path.suffix}")
    return count


def _write_csv(rows: Iterable[tuple], file: Path) -> int:
    count = 0
    with file.open("w", newline="", encoding="utf-8") as opened:
        writer = csv.writer(opened)
        writer.writerow(PLAIN_COLUMNS)
        for row in rows:
            writer.writerow(map(csv_cell, row))
            count += 1
    return count


def _parquet_writer() -> Callable[[Iterable[tuple], Path], int]:
    """Return a function that writes rows to Parquet; raise StoreError if pyarrow is missing."""
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise StoreError(
            "Parquet needs pyarrow. Install it: pip install chaincor[export]"
        ) from None
    types = {str: pa.string(), int: pa.int64(), float: pa.float64(), bool: pa.bool_()}
    kinds = [_kind_of(name) for name in PLAIN_COLUMNS]
    names = [*zip(PLAIN_COLUMNS, map(types.get, kinds), strict=True)]
    schema = pa.schema(names)

    def write(rows: Iterable[tuple], file: Path) -> int:
        count, given = 0, iter(rows)
        with parquet.ParquetWriter(file, schema) as writer:
            while group := [*itertools.islice(given, _ROW_GROUP)]:
                columns = [
                    pa.array([None if value is None else kind(value) for value in values], type_)
                    for values, kind, (_, type_) in zip(
                        zip(*group, strict=True), kinds, names, strict=True
                    )
                ]
                writer.write_table(pa.table(columns, schema=schema))
                count += len(group)
        return count

    return write


def _kind_of(column: str) -> type:
    """Return the type of a column in an export; lists, paths and formulas are exported as text."""
    if column in FLAG_COLUMNS:
        return bool
    observable = OBSERVABLES.get(column)
    kind = DECLARED.get(column, ("" if observable is None else observable.kind, False))[0]
    if kind in _KINDS:
        return _KINDS[kind]
    field = Scene.model_fields.get(column)
    annotation = None if field is None else field.annotation
    # The annotation is an optional number, or a number with conditions.
    given = [get_args(each)[0] for each in get_args(annotation) if get_origin(each) is Annotated]
    return next((each for each in given if each in (int, float)), str)


def export_crate(store: Store | StoreSet, folder: Path) -> int:
    """
    Write all rows to ``results.csv`` in an RO-Crate folder, and return their number.

    Raise MissingLibraryError if the library rocrate is missing. Raise InputError if the folder
    contains anything but an earlier export.
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
    versions: set[tuple[str, str]] = set()
    for part, _ in store.parts():
        known = part.select("SELECT versions, id FROM environments")[1]
        check_rows(part.path, ["versions"], known, [f"environment {number}" for _, number in known])
        versions |= {pair for text, _ in known for pair in json.loads(text).items()}
    describe_folder(
        folder,
        f"{rows} collisions of one-dimensional chains, computed by chaincor",
        {table.name: "One row a collision: what collides, what came out, and how."},
        sorted(versions),
        {name: _meaning(name) for name in PLAIN_COLUMNS},
    )
    return rows


def _meaning(column: str) -> str:
    known = OBSERVABLES.get(column)
    return column.replace("_", " ") if known is None else known.meaning


def to_pandas(store: Store | Path | str | Sequence[Path | str]) -> "pandas.DataFrame":
    """
    Return all rows as a data frame.

    Parameters
    ----------
    store : Store or path or sequence of paths
        An open store, its file, or several files and folders that are read as one store.

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
    if isinstance(store, Store):
        opened: Any = nullcontext(store)
    else:
        paths = store if isinstance(store, list | tuple) else [store]
        opened = open_stores([path_given("the results store", path) for path in paths])
    with opened as stores:
        rows = [*_rows(stores)]
    frame = require_pandas().DataFrame.from_records(rows, columns=list(PLAIN_COLUMNS))
    names = ("contacts", "fragments", *WHOLE_KEYS, "table_points", "target_particles")
    whole = dict.fromkeys(names, "Int64")
    return frame.astype(whole | dict.fromkeys(FLAG_COLUMNS, "boolean"))


def require_pandas() -> Any:
    """Import and return pandas; raise StoreError if pandas is missing."""
    try:
        import pandas as pd
    except ImportError:
        raise StoreError("pandas is not installed. Install it: pip install pandas") from None
    return pd


def _rows(store: Store | StoreSet) -> Iterator[tuple]:
    return iterate_rows(store, PLAIN_COLUMNS, order=("potential", "particles", "velocity"))
