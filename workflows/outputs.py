"""Files that a command is asked to write: refused before it works where they cannot be written."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from chaincor.analysis.atomic_write import refuse_no_file
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script import DATA_FILE, SCENE_FILE, SCRIPT_FILE, TABLE_FILE

# In which formats figures are drawn.
PICTURES = (".png", ".pdf", ".svg")
PICTURES_SAID = ".png, .pdf or .svg"
# What is near the beginning of a file of a kind, as a pattern.
_MARKS = {
    "dump": b"ITEM:",
    "arrays": b"PK",
    "xyz": rb"^\d+\nProp",
    ".csv": b"potential,",
    ".html": b"<!doctype html>",
    ".gif": b"GIF8",
    ".mp4": b"ftyp",
    ".png": b"PNG",
    ".pdf": b"%PDF",
    ".svg": rb"<\?xml",
    ".parquet": b"PAR1",
}


def refuse_unusable_outputs(scene: Scene) -> None:
    """
    Check where a collision's files go, before any time is spent on it.

    Raises InputError if two outputs have one path, a file is wanted where a folder is, or a folder
    where a file is, and where what is there would be lost: a file of another kind, the job of
    another collision. The same run again replaces its own files.
    """
    if scene.dump is None and "dump_frames" in scene.model_fields_set:
        raise InputError(
            f"dump_frames is {scene.dump_frames!r} and there is no dump; expected the dump whose "
            "frames these are: give dump, or drop dump_frames"
        )
    given = _outputs(scene)
    paths = {key: path.absolute() for key, path in given.items()}
    if len(set(paths.values())) < len(paths):
        raise InputError(f"{' and '.join(paths)} share a path; expected one for each: give another")
    for key, path in paths.items():
        folder = path if key == "save" else path.parent
        in_the_way = [p for p in (folder, *folder.parents) if p.exists() and not p.is_dir()]
        if in_the_way or (key != "save" and path.is_dir()):
            found = f"{str(in_the_way[0])!r} is a file" if in_the_way else "that is a folder"
            raise InputError(f"{key} is {str(given[key])!r}, but {found}; give another path")
        if key == "save":
            _refuse_another_job(scene, given[key])
        else:
            refuse_other_kinds(given[key], key)


def _outputs(scene: Scene) -> dict[str, Path]:
    """Return where a scene's files go, by the keys that say so."""
    given = {key: getattr(scene, key) for key in ("dump", "arrays", "save")}
    return {key: path for key, path in given.items() if path is not None}


def refuse_other_kinds(path: Path, kind: str) -> None:
    """
    Refuse to write over what is no earlier output of a kind: "dump", "arrays", "xyz", or an ending.

    Raises InputError if there is a folder or a device, or a file that is neither empty nor of this
    kind; of endings that no command writes nothing is said.
    """
    if not path.exists():
        return
    refuse_no_file(path)
    try:
        with path.open("rb") as file:
            found = file.read(16)
    except OSError as error:
        raise InputError(f"cannot read {str(path)!r} to replace it: {error.strerror}") from None
    if found and not re.search(_MARKS.get(kind, b""), found):
        raise InputError(
            f"{str(path)!r} was given to write to, and holds something else; give another path, or "
            "remove it"
        )


def make_folder(folder: Path) -> None:
    """Make a folder and those above it; raises InputError where that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot make the folder {str(folder)!r}: {error.strerror}; give another"
        ) from None


def refuse_overwriting_inputs(output: Path, inputs: Iterable[Path], option: str) -> None:
    """
    Raise InputError where a file that is to be written is one that is read, or a link to one.

    Files need not be there; `option` is what `output` was given as, such as ``--output``.
    """
    for path in inputs:
        if _is_one_file(output, path):
            also = "" if str(path) == str(output) else f", the same file as {str(path)!r}"
            raise InputError(
                f"{option} is {str(output)!r}{also}, which this command reads; expected another "
                "file: give another name"
            )


def _refuse_another_job(scene: Scene, folder: Path) -> None:
    names = (SCRIPT_FILE, DATA_FILE, TABLE_FILE, SCENE_FILE)
    there = [name for name in names if (folder / name).exists()]
    if not there:
        return
    try:
        kept = Scene.from_file(folder / SCENE_FILE)
    except InputError:  # also where there is none
        kept = None
    if kept is None or kept.collision_sha256 != scene.collision_sha256:
        raise InputError(
            f"save is {str(folder)!r}, which has {', '.join(there)} of something else; give "
            "another folder, or remove these"
        )


def refuse_shared_outputs(scenes: Sequence[Scene]) -> None:
    """Raise InputError if two scenes would write to one path."""
    owners: dict[Path, int] = {}
    for number, scene in enumerate(scenes, start=1):
        for key, path in _outputs(scene).items():
            owner = owners.setdefault(path.absolute(), number)
            if owner != number:
                raise InputError(
                    f"{key} is {str(path)!r} in scenes {owner} and {number}; expected a path of "
                    "its own for each"
                )


def _is_one_file(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except (OSError, ValueError):  # one of them is not there, or no name at all
        return False
