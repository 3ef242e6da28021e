"""Scene files: TOML to fields, not yet validated."""

import tomllib
from pathlib import Path
from typing import Any

from chaincor.lammps_inputs.errors import SceneError


def parse_toml(text: str, source: str) -> dict[str, Any]:
    """Parse TOML text; SceneError, which names the source, if it is none."""
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise SceneError(f"{source} is not valid TOML: {error}") from None


def read_scene_fields(path: Path | str) -> dict[str, Any]:
    """
    Read the fields of a TOML scene file, not yet validated.

    A relative `bond_file` in it is taken from the file's folder.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or type(error).__name__
        raise SceneError(f"cannot read the scene file {str(path)!r}: {reason}") from None
    fields = parse_toml(text, str(path))
    if isinstance(fields.get("bond_file"), str):
        fields["bond_file"] = path.parent / fields["bond_file"]
    return fields
