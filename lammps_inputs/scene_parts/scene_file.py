"""Read the fields of scene files in TOML, without validation."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.scene_parts.given_masses import masses_in
from chaincor.lammps_inputs.scene_parts.scene_fields import FILES_READ, MASSES_READ
from chaincor.lammps_inputs.small_file import read_small_file, why_unreadable
from chaincor.lammps_inputs.toml_text import parse_toml

if TYPE_CHECKING:
    from chaincor.lammps_inputs.scene import Scene

# Largest size of a scene file, in bytes. Longer lists belong in separate files.
_LARGEST = 100_000_000


def read_scene_fields(path: Path | str) -> dict[str, Any]:
    """
    Read the fields of a TOML scene file, without validation.

    Paths in `FILES_READ` and `MASSES_READ` are relative to the folder of the scene file. Raises
    SceneError if the file cannot be read.
    """
    path = Path(path)
    try:
        text = read_small_file(path, _LARGEST, pipes=True)
    except (OSError, ValueError) as error:
        raise SceneError(
            f"cannot read the scene file {str(path)!r}: {why_unreadable(error)}. Give a "
            "text file in TOML"
        ) from None
    return from_folder(parse_toml(text, str(path)), path.parent)


def from_folder(fields: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return fields in which relative paths of files to read are resolved from a folder."""
    found = dict(fields)
    for key, value in fields.items():
        if not isinstance(value, str):
            continue
        if key in FILES_READ or (key in MASSES_READ and masses_in(value) is None):
            found[key] = folder / value
    return found


def read_from_anywhere(scene: "Scene") -> "Scene":
    """Return a scene with absolute paths of the files to read. It can be saved in any folder."""
    paths = {key: path.resolve() for key in FILES_READ if (path := getattr(scene, key)) is not None}
    return scene.replace(**paths)
