"""Prepare the notebook of a lesson: its folder, its shell cells, and prepared data."""

import itertools
import os
import sys
from pathlib import Path
from typing import Any

from chaincor.lammps_inputs.errors import InputError, meant
from chaincor.workflows.documents import DOCUMENTS

# Folder of the notebook. It is stored before the first lesson changes the current folder, so that
# repeated cells do not create nested folders.
_home: list[Path] = []
# Name of the last lesson that was begun.
_lesson: list[str] = []


def begin(lesson: str) -> None:
    """
    Change to a new folder for a lesson, and make `chaincor` and `lmp` available to shell cells.

    The folder is ``LESSON_files`` beside the notebook. The folder of an earlier run is renamed to
    ``LESSON_files_earlier``, ``LESSON_files_earlier_2`` and so on. The path of the MPI library that
    `lmp` needs is added to the environment.

    Parameters
    ----------
    lesson : str
        Name of the lesson, which is also used for the folder.

    Raises
    ------
    InputError
        If the folder cannot be created.
    """
    if not _home:
        _home.append(Path.cwd())
    _lesson[:] = [lesson]
    folder = _new_folder(_home[0], lesson)
    os.chdir(folder)
    _let_the_shell_find_commands()
    print(f"files of this lesson: {folder}")


def _new_folder(home: Path, lesson: str) -> Path:
    folder = home / f"{lesson}_files"
    try:
        os.chdir(home)  # Windows cannot rename the current folder.
        if folder.is_dir() and any(folder.iterdir()):
            numbers = (f"_{number}" if number > 1 else "" for number in itertools.count(1))
            earlier = (home / f"{folder.name}_earlier{number}" for number in numbers)
            kept = next(path for path in earlier if not path.exists())
            folder.rename(kept)
            print(f"files of an earlier run: {kept}")
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot make a folder for the lesson in {str(home)!r} "
            f"({error.strerror}). Open the notebook in a folder where you can write"
        ) from None
    return folder


def _let_the_shell_find_commands() -> None:
    """Put the environment of this Python first in PATH, because Jupyter may run outside of it."""
    from chaincor.workflows.engines.lammps.library import folder_first, lmp_environment

    os.environ["PATH"] = folder_first("PATH", Path(sys.executable).parent)
    os.environ.update(lmp_environment())
    # IPython runs programs as if on a terminal, but cannot show a moving progress bar.
    os.environ.pop("FORCE_COLOR", None)
    os.environ["TERM"] = "dumb"


def show_figure(name: str) -> Any:
    """
    Return a saved figure for a notebook, with the alternative text from the lesson's page.

    All figures of pyplot are closed. Otherwise the notebook would show them a second time.
    """
    from IPython.display import Image

    from chaincor.workflows.lessons.notebooks import words_of_picture

    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")
    return Image(filename=name, alt=words_of_picture(_lesson[0], name) if _lesson else "")


def prepared(name: str) -> Path:
    """
    Return the path of a file with prepared results, which readers with slow machines can use.

    Raise InputError if there is no file with this name.
    """
    folder = DOCUMENTS / "course" / "data"
    names = sorted(path.name for path in folder.glob("*.csv"))
    if name not in names:
        near = meant(name, names)
        hint = "" if near is None else f". Did you mean '{near}'?"
        raise InputError(f"there is no data {name!r}. Use one of {', '.join(names)}{hint}")
    return folder / name
