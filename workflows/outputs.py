"""Files a collision is asked to write: refused before it runs where they cannot be written."""

from collections.abc import Sequence
from pathlib import Path

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene


def refuse_unusable_outputs(scene: Scene) -> None:
    """
    Check where a collision's files go, before any time is spent on it.

    Raises InputError if two outputs have one path, a file is wanted where a folder is, or a folder
    where a file is.
    """
    if scene.dump is None and "dump_frames" in scene.model_fields_set:
        raise InputError(
            f"dump_frames is {scene.dump_frames!r} and there is no dump; expected the dump whose "
            "frames these are: give dump, or drop dump_frames"
        )
    given = {key: getattr(scene, key) for key in ("dump", "arrays", "save")}
    paths = {key: path.absolute() for key, path in given.items() if path is not None}
    if len(set(paths.values())) < len(paths):
        raise InputError(f"{' and '.join(paths)} share a path; expected one for each: give another")
    for key, path in paths.items():
        folder = path if key == "save" else path.parent
        in_the_way = [p for p in (folder, *folder.parents) if p.exists() and not p.is_dir()]
        if in_the_way or (key != "save" and path.is_dir()):
            found = f"{str(in_the_way[0])!r} is a file" if in_the_way else "that is a folder"
            raise InputError(f"{key} is {str(given[key])!r}, but {found}; give another path")


def refuse_shared_outputs(scenes: Sequence[Scene]) -> None:
    """Raise InputError if two scenes would write to one path."""
    owners: dict[Path, int] = {}
    for number, scene in enumerate(scenes, start=1):
        for key in ("dump", "arrays", "save"):
            path = getattr(scene, key)
            if path is None:
                continue
            owner = owners.setdefault(path.absolute(), number)
            if owner != number:
                raise InputError(
                    f"{key} is {str(path)!r} in scenes {owner} and {number}; expected a path of "
                    "its own for each"
                )
