"""The first cell of a lesson: a folder for its files, and a shell that finds the commands."""

import os
import sys
from pathlib import Path

from chaincor.lammps_inputs.errors import InputError

# Where the session was before its first lesson: a cell that is run again must not go deeper.
_home: list[Path] = []


def begin(lesson: str) -> None:
    """
    Go to a new folder for the files of a lesson, and let shell cells find `chaincor` and `lmp`.

    The folder is ``LESSON_files`` beside the notebook, or ``LESSON_files_2`` and so on where there
    is one with files in it: nothing is overwritten. `lmp` is also told where its MPI library is.

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
    folder = _new_folder(_home[0], lesson)
    os.chdir(folder)
    _let_the_shell_find_commands()
    print(f"files of this lesson: {folder}")


def _new_folder(home: Path, lesson: str) -> Path:
    try:
        for number in range(1, 1000):
            folder = home / (f"{lesson}_files" if number == 1 else f"{lesson}_files_{number}")
            folder.mkdir(exist_ok=True)
            if not any(folder.iterdir()):
                return folder
    except OSError as error:
        raise InputError(
            f"no folder for the lesson can be made in {str(home)!r}: {error.strerror}; expected "
            "one to write to: open the notebook in a folder of your own"
        ) from None
    raise InputError(f"{home} has 999 folders of this lesson; expected fewer: remove some")


def _let_the_shell_find_commands() -> None:
    """Put this environment first, as activating it does: Jupyter may have been started without."""
    from chaincor.workflows.engines.lammps.library import find_mpi_library

    _put_first("PATH", Path(sys.executable).parent)
    # Jupyter's kernel sets this, and programs would draw progress bars as if on a terminal.
    os.environ.pop("FORCE_COLOR", None)
    library = find_mpi_library()
    if library is not None:
        _put_first("LD_LIBRARY_PATH", library.parent)


def _put_first(variable: str, folder: Path) -> None:
    before = [place for place in os.environ.get(variable, "").split(os.pathsep) if place]
    os.environ[variable] = os.pathsep.join([str(folder), *(p for p in before if p != str(folder))])
