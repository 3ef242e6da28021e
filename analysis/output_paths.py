"""Resolve output paths, and check them against existing files before anything is written."""

import os
import re
from collections.abc import Iterable
from pathlib import Path

from chaincor.lammps_inputs.errors import InputError

# Pattern in the first _BEGINNING bytes of a file, by kind of output. The patterns recognize outputs
# of chaincor and not only the format, so that no dump, archive or page of another program is
# overwritten.
_BEGINNING = 1024
_MARKS = {
    "dump": rb"(?s)^ITEM: .*\nITEM: ATOMS [^\n]*v_displacement",
    "arrays": rb"(?s)^PK\x03\x04.{26}contact_times\.npy",
    "xyz": rb"^\d+\nProperties=\S*:displacement:R:1:masses:R:1 ",
    "results": rb"^potential,toda_b,",
    ".html": rb"(?s)^<!doctype html>.*<title>A chain meets a wall",
    ".gif": rb"^GIF8",
    ".mp4": rb"(?s)^.{4}ftyp",
    ".png": rb"(?s)^\x89PNG.*Matplotlib",
    ".pdf": rb"^%PDF-1\.\d\n%\xac\xdc \xab\xba\n",
    ".svg": rb"(?s)^<\?xml.*Matplotlib",
    ".parquet": rb"^PAR1",
}


def resolve_output(path: Path) -> Path:
    """
    Resolve links and ``..`` in the folder of an output path.

    A file name that is itself a link is not followed, and writing replaces the link. Raises
    InputError if the path leads nowhere.
    """
    try:
        folder = path.parent.resolve()
        place = folder.resolve() if path.name in ("", "..") else folder / path.name
        place.exists()
    except (OSError, RuntimeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise InputError(f"{str(path)!r} cannot be written ({reason}); give another path") from None
    return place


def resolve_folder(folder: Path) -> Path:
    """Resolve links and ``..`` in the path of an output folder; for errors see `resolve_output`."""
    return resolve_output(folder / "in").parent


def judge_output(path: Path, kind: str) -> Path:
    """
    Return the resolved path of an output that may be written.

    `kind` is "dump", "arrays", "xyz", "results" (CSV of a store), or the ending of the file. Raises
    InputError if the path is a folder or a device, or a file that is neither empty nor an earlier
    output of this kind. Files with other endings are not examined.
    """
    place = resolve_output(path)
    refuse_no_file(place)
    _refuse_blocked(place.parent)
    if not place.exists():
        return place
    try:
        with place.open("rb") as file:
            found = file.read(_BEGINNING)
    except OSError as error:
        raise InputError(f"cannot read {str(path)!r} to replace it: {error.strerror}") from None
    if found and not re.search(_MARKS.get(kind, b""), found):
        raise InputError(
            f"{str(path)!r} holds something else and is not overwritten. Give another path, or "
            "remove the file"
        )
    return place


def refuse_no_file(path: Path) -> None:
    """Raise InputError if the path of an output is a folder or a device."""
    if path.exists() and not path.is_file():
        found = "a folder" if path.is_dir() else "a device"
        raise InputError(
            f"{str(path)!r} cannot be written, because it is {found}. Give another path"
        )


def _refuse_blocked(folder: Path) -> None:
    """Raise InputError if a folder cannot be made or is not writable."""
    nearest = next(path for path in (folder, *folder.parents) if path.exists())
    if not nearest.is_dir():
        raise InputError(f"{str(nearest)!r} is a file. Give another path, inside a folder")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise InputError(
            f"cannot write into {str(nearest)!r}. Give a folder in which you may write"
        )


def judge_folder(folder: Path, sign: str, names: Iterable[str]) -> Path:
    """
    Return the resolved folder of a report that may be written.

    An earlier report, which is recognised by the file `sign` in its folder, is replaced. Raises
    InputError if the path is a file, or if the folder contains other files of `names` but no file
    `sign`.
    """
    place = resolve_output(folder / sign).parent
    _refuse_blocked(place)
    present = [name for name in names if (place / name).exists()]
    if present and not (place / sign).is_file():
        raise InputError(
            f"the folder {str(folder)!r} holds files of something else "
            f"({', '.join(present[:3])}). Give another folder, or remove them"
        )
    return place
