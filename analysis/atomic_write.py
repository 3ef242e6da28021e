"""Writers of files that appear only when they are complete."""

import errno
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from chaincor.analysis.output_paths import judge_output, resolve_output
from chaincor.lammps_inputs.errors import InputError

# The system reports these errors for a full disk, a user's quota, and a limit on the size of files.
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@contextmanager
def written_aside(path: Path, kind: str | None = None) -> Iterator[Path]:
    """
    Yield a temporary path beside the wanted path, and rename it on success.

    The temporary path has the ending of the wanted path. By default `kind` is this ending; see
    :func:`~chaincor.analysis.output_paths.judge_output`. Raises InputError if `judge_output` does,
    or if the folder cannot be written to.
    """
    place = judge_output(path, path.suffix if kind is None else kind)
    with folder_aside(place.parent, prefix=path.stem) as folder:
        try:
            yield folder / path.name
        except OSError as error:
            _name_what_was_written(error, path)
            raise


def write_whole(path: Path, text: str, kind: str | None = None) -> None:
    """Write a text to a file that appears when complete; see `written_aside` for the arguments."""
    with written_aside(path, kind) as aside:
        aside.write_text(text, encoding="utf-8")


@contextmanager
def made_folder(folder: Path, whole: bool = False) -> Iterator[None]:
    """
    Make a folder and its parents; if the block fails, remove those that are new and empty.

    With `whole`, new folders are removed with all their files, because incomplete files are
    useless.
    """
    new = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    except Exception:
        if new and whole:
            shutil.rmtree(new[-1], ignore_errors=True)
        with suppress(OSError):
            for each in new:
                each.rmdir()
        raise


@contextmanager
def folder_aside(folder: Path, prefix: str = "partial") -> Iterator[Path]:
    """
    Yield an empty folder to fill, and move its files into the wanted one on success.

    A missing folder is created. Files with other names stay in the wanted folder. The name of the
    temporary folder begins with `prefix`. Raises InputError if the folder cannot be written to.
    """
    folder, began = resolve_output(folder / prefix).parent, False
    try:
        with (
            made_folder(folder),
            TemporaryDirectory(
                prefix=f".{prefix}-", dir=folder, ignore_cleanup_errors=True
            ) as aside,
        ):
            began = True
            yield Path(aside)
            for path in sorted(Path(aside).iterdir()):
                path.replace(folder / path.name)
    except OSError as error:
        if not began:
            reason = error.strerror or type(error).__name__
            raise InputError(f"cannot write into {folder}: {reason}") from None
        _name_what_was_written(error, folder)
        raise


def publish(aside: Path, folder: Path) -> None:
    """
    Copy the files written so far from the temporary folder into the wanted folder.

    If a figure fails later, data that took long to compute is then not lost.
    """
    copy = aside / ".copy"
    for path in sorted(path for path in aside.iterdir() if path.is_file()):
        shutil.copy2(path, copy)
        copy.replace(folder / path.name)


def _name_what_was_written(error: OSError, path: Path) -> None:
    """Put the user's path into an error that names no path, or only the source of a copy."""
    named = error.filename
    if named is None or (error.errno in _NO_ROOM and not Path(str(named)).is_relative_to(path)):
        error.filename = str(path)


def write_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """
    Pack arrays in memory, and write them to an NPZ file.

    NumPy is not given the path: on a full disk, older versions print an error that cannot be
    suppressed when they delete the unfinished archive.
    """
    import numpy as np

    packed = BytesIO()
    # Do not pass `allow_pickle=False`: NumPy before 2.1 would store this argument as an array.
    np.savez_compressed(packed, **arrays)
    path.write_bytes(packed.getbuffer())
