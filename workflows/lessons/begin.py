"""What cells of a lesson begin with: its folder, a shell that finds commands, data made before."""

import itertools
import os
import sys
from pathlib import Path
from typing import Any

from chaincor.lammps_inputs.errors import InputError, meant
from chaincor.workflows.documents import DOCUMENTS

# Where the session was before its first lesson: a cell that is run again must not go deeper.
_home: list[Path] = []
# The lesson that was begun last.
_lesson: list[str] = []


def begin(lesson: str) -> None:
    """
    Go to a new folder for the files of a lesson, and let shell cells find `chaincor` and `lmp`.

    The folder is ``LESSON_files`` beside the notebook. Files of an earlier run are kept: what there
    is becomes ``LESSON_files_earlier``, or ``LESSON_files_earlier_2`` and so on. `lmp` is also told
    where its MPI library is.

    Parameters
    ----------
    lesson : str
        Name of the lesson, for its folder.

    Raises
    ------
    InputError
        If the folder cannot be made.
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
        os.chdir(home)  # Windows renames no folder that one is in
        if folder.is_dir() and any(folder.iterdir()):
            numbers = (f"_{number}" if number > 1 else "" for number in itertools.count(1))
            earlier = (home / f"{folder.name}_earlier{number}" for number in numbers)
            kept = next(path for path in earlier if not path.exists())
            folder.rename(kept)
            print(f"files of an earlier run: {kept}")
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(
            f"no folder for the lesson can be made in {str(home)!r}: {error.strerror}; expected "
            "one to write to: open the notebook in a folder of your own"
        ) from None
    return folder


def _let_the_shell_find_commands() -> None:
    """Put this environment first, as activating it does: Jupyter may have been started without."""
    from chaincor.workflows.engines.lammps.library import folder_first, lmp_environment

    os.environ["PATH"] = folder_first("PATH", Path(sys.executable).parent)
    os.environ.update(lmp_environment())
    # IPython runs programs as if on a terminal, but shows no bar that moves.
    os.environ.pop("FORCE_COLOR", None)
    os.environ["TERM"] = "dumb"


def show_figure(name: str) -> Any:
    """
    Return a saved figure for a notebook to show, with the words of the lesson's page as its text.

    Figures of pyplot are closed, so that the notebook does not show them a second time.
    """
    from IPython.display import Image

    from chaincor.workflows.lessons.notebooks import words_of_picture

    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")
    return Image(filename=name, alt=words_of_picture(_lesson[0], name) if _lesson else "")


def prepared(name: str) -> Path:
    """
    Return the path of a file of data made beforehand, for machines that are slow.

    Raises InputError if there is none of that name.
    """
    folder = DOCUMENTS / "course" / "data"
    names = sorted(path.name for path in folder.glob("*.csv"))
    if name not in names:
        near = meant(name, names)
        hint = "" if near is None else f"; did you mean '{near}'?"
        raise InputError(f"there is no data {name!r}; expected one of {', '.join(names)}{hint}")
    return folder / name
