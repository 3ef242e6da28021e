"""Where the texts of the lessons are, and the data made beforehand."""

from pathlib import Path

from chaincor.lammps_inputs.errors import InputError, meant
from chaincor.workflows.documents import DOCUMENTS


def lesson_pages() -> dict[str, Path]:
    """Return the pages that become notebooks, in their order: eight lessons, and the class."""
    found = [*(DOCUMENTS / "tutorials").glob("*.md"), DOCUMENTS / "course" / "class.md"]
    return {path.stem: path for path in sorted(found, key=lambda path: path.stem)}


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
