"""Scene files: TOML to fields, not yet validated."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.scene_parts.given_bodies import masses_in
from chaincor.lammps_inputs.small_file import read_small_file, why_unreadable
from chaincor.lammps_inputs.toml_text import parse_toml

if TYPE_CHECKING:
    from chaincor.lammps_inputs.scene import Scene

# Keys that name files to be read, and those that may: numbers with commas between them are none.
FILES_READ = ("bond_file", "initial")
MASSES_READ = ("masses", "target_masses")
# Bytes of a scene file: longer lists than that are files of their own.
_LARGEST = 100_000_000


def read_scene_fields(path: Path | str) -> dict[str, Any]:
    """
    Read the fields of a TOML scene file, not yet validated.

    Relative paths of files that it names (`FILES_READ`) are taken from the file's folder.
    """
    path = Path(path)
    try:
        text = read_small_file(path, _LARGEST, pipes=True)
    except (OSError, ValueError) as error:
        raise SceneError(
            f"cannot read the scene file {str(path)!r}: {why_unreadable(error)}; expected a text "
            "file in TOML"
        ) from None
    return from_folder(parse_toml(text, str(path)), path.parent)


def from_folder(fields: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return fields in which relative paths of files to be read start from a folder."""
    found = dict(fields)
    for key, value in fields.items():
        if not isinstance(value, str):
            continue
        if key in FILES_READ or (key in MASSES_READ and masses_in(value) is None):
            found[key] = folder / value
    return found


def read_from_anywhere(scene: "Scene") -> "Scene":
    """Return a scene that names the files it reads by whole paths, to be written anywhere."""
    paths = {key: path.resolve() for key in FILES_READ if (path := getattr(scene, key)) is not None}
    return scene.replace(**paths)
