"""Files that appear when they are complete, and never half written."""

import errno
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

from chaincor.lammps_inputs.errors import InputError

# A full disk, one that is full for this user, and a file that may not be so large.
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def refuse_no_file(path: Path) -> None:
    """Raise InputError if there is a folder or a device where a file is to be written."""
    if path.exists() and not path.is_file():
        found = "a folder" if path.is_dir() else "a device"
        raise InputError(
            f"{str(path)!r} was given as the file to write, but that is {found}; give another path"
        )


@contextmanager
def written_aside(path: Path) -> Iterator[Path]:
    """
    Yield a path beside the wanted one, with its ending, and rename it to that on success.

    Raises InputError if there is a folder or a device of this name, or its folder cannot be written
    to.
    """
    refuse_no_file(path)
    with folder_aside(path.parent, prefix=path.stem) as folder:
        try:
            yield folder / path.name
        except OSError as error:
            _name_what_was_written(error, path)
            raise


def write_whole(path: Path, text: str) -> None:
    """Write a text so that its file appears when it is complete; raises as `written_aside`."""
    with written_aside(path) as aside:
        aside.write_text(text, encoding="utf-8")


@contextmanager
def folder_aside(folder: Path, prefix: str = "partial") -> Iterator[Path]:
    """
    Yield an empty folder to fill, and move its files into the wanted one on success.

    The folder is made if it is not there; files of other names in it stay. `prefix` starts the name
    of the temporary one. Raises InputError if the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        aside = Path(tempfile.mkdtemp(prefix=f".{prefix}-", dir=folder))
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise InputError(f"cannot write into {folder}: {reason}") from None
    try:
        yield aside
        for path in sorted(aside.iterdir()):
            path.replace(folder / path.name)
    except OSError as error:
        _name_what_was_written(error, folder)
        raise
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _name_what_was_written(error: OSError, path: Path) -> None:
    """Let an error say what the user named: a write knows no name, a copy that of its source."""
    named = error.filename
    if named is None or (error.errno in _NO_ROOM and not Path(str(named)).is_relative_to(path)):
        error.filename = str(path)


def write_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """
    Write arrays to an NPZ file, packed in memory first.

    Where a disk is full, an unfinished archive of older NumPy versions complains when it is
    forgotten, and nothing can keep that from the user's screen.
    """
    import numpy as np

    packed = BytesIO()
    # Not `allow_pickle=False`: before NumPy 2.1 that is kept as one more array.
    np.savez_compressed(packed, **arrays)
    path.write_bytes(packed.getbuffer())
