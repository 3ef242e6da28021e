"""Files that a command reads are never those that it writes."""

from collections.abc import Iterable
from pathlib import Path

from chaincor.lammps_inputs.errors import InputError


def refuse_overwriting_inputs(output: Path, inputs: Iterable[Path], option: str) -> None:
    """
    Refuse to write over a file that is read, under whatever name.

    Parameters
    ----------
    output : pathlib.Path
        Where a file is to be written; it need not be there.
    inputs : iterable of pathlib.Path
        What is read; what is not there is for others to tell.
    option : str
        What `output` was given as, such as ``--output``.

    Raises
    ------
    InputError
        If the output is one of the inputs, or a link to one.
    """
    for path in inputs:
        if _is_one_file(output, path):
            also = "" if str(path) == str(output) else f", the same file as {str(path)!r}"
            raise InputError(
                f"{option} is {str(output)!r}{also}, which this command reads; expected another "
                "file: give another name"
            )


def _is_one_file(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except (OSError, ValueError):  # one of them is not there, or no name at all
        return False
