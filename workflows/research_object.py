"""
Describe a folder of results as an RO-Crate, with its files, columns and programs.

The option ``--rocrate`` of `store` and `reproduce` uses this module.
"""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from chaincor.analysis.atomic_write import write_whole
from chaincor.workflows.errors import MissingLibraryError

# The specification of RO-Crates requires this file name.
METADATA_FILE = "ro-crate-metadata.json"
_KINDS = {
    ".csv": "text/csv",
    ".html": "text/html",
    ".json": "application/json",
    ".md": "text/markdown",
    ".pdf": "application/pdf",
    ".png": "image/png",
    ".sqlite": "application/vnd.sqlite3",
    ".svg": "image/svg+xml",
}
_UNLICENSED = "No licence is stated. Name a licence here before you share these results."


def require_rocrate() -> Any:
    """Return the class ``ROCrate``; raise MissingLibraryError if rocrate is not installed."""
    try:
        from rocrate.rocrate import ROCrate
    except ImportError:
        raise MissingLibraryError(
            "--rocrate needs the library rocrate, which is not installed. Install "
            "it: pip install chaincor[crate]"
        ) from None
    return ROCrate


def describe_folder(
    folder: Path,
    title: str,
    files: Mapping[str, str],
    versions: Iterable[tuple[str, str]],
    columns: Mapping[str, str] | None = None,
) -> None:
    """
    Write ``ro-crate-metadata.json`` (RO-Crate 1.1) into a folder of results.

    `files` contains a description of each file, by path; `columns` contains a description of each
    table column, by name. `versions` contains names and versions of the programs and libraries that
    made the results. Raises MissingLibraryError if the library rocrate is not installed.
    """
    crate = require_rocrate()(version="1.1")
    crate.name, crate.description, crate.license = title, title, _UNLICENSED
    results = [
        crate.add_file(
            folder / path,
            path,
            properties={
                "name": path,
                "description": description,
                "encodingFormat": _KINDS[Path(path).suffix],
                "contentSize": str((folder / path).stat().st_size),
            },
        )
        for path, description in files.items()
    ]
    software = [
        _entity(crate, f"{name}-{version}", "SoftwareApplication", name, softwareVersion=version)
        for name, version in versions
    ]
    variables = [
        _entity(crate, f"column-{name}", "PropertyValue", name, description=description)
        for name, description in (columns or {}).items()
    ]
    parts = {"instrument": _named(software), "result": _named(results)}
    computation = _entity(crate, "computation", "CreateAction", title, **parts)
    crate.root_dataset["mentions"] = _named([computation])
    if variables:
        crate.root_dataset["variableMeasured"] = _named(variables)
    text = json.dumps(crate.metadata.generate(), indent=1, ensure_ascii=False)
    write_whole(folder / METADATA_FILE, text)


def _entity(crate: Any, place: str, kind: str, name: str, **more: Any) -> Any:
    return crate.add_jsonld({"@id": f"#{place}", "@type": kind, "name": name, **more})


def _named(entities: Iterable[Any]) -> list[dict[str, str]] | dict[str, str]:
    """Return references to entities as RO-Crate 1.1 requires: one reference alone, or a list."""
    named = [{"@id": entity.id} for entity in entities]
    return named[0] if len(named) == 1 else named
