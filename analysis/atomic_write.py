"""Files that appear when they are complete, and never half written."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from chaincor.lammps_inputs.errors import InputError


@contextmanager
def written_aside(path: Path) -> Iterator[Path]:
    """
    Yield a path to write to, and rename it to the wanted one on success.

    Parameters
    ----------
    path : pathlib.Path
        The file wanted.

    Yields
    ------
    pathlib.Path
        A path beside it, with the same ending.

    Raises
    ------
    InputError
        If its folder cannot be written to.
    """
    with folder_aside(path.parent, prefix=path.stem) as folder:
        aside = folder / path.name
        yield aside


@contextmanager
def folder_aside(folder: Path, prefix: str = "partial") -> Iterator[Path]:
    """
    Yield an empty folder to fill, and move its files into the wanted one on success.

    Parameters
    ----------
    folder : pathlib.Path
        Where the files are wanted; made if it is not there. Files of other names in it stay.
    prefix : str
        Start of the name of the temporary folder.

    Yields
    ------
    pathlib.Path
        The folder to fill.

    Raises
    ------
    InputError
        If the folder cannot be written to.
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
    finally:
        shutil.rmtree(aside, ignore_errors=True)
