"""Build the JSON objects that commands print."""

import json
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from chaincor.workflows.versions import processor, versions

if TYPE_CHECKING:
    from chaincor.lammps_inputs.scene import Scene

# The version increases if a key changes its meaning or disappears, not if a key is added.
SCHEMA = 1


def stamped(plain: Mapping[str, Any], scene: "Scene | None" = None) -> dict[str, Any]:
    """
    Return the keys of a command and the keys that all JSON objects have in common.

    The common keys are ``schema``, ``versions`` and ``processor``. The object of a command with one
    scene also has the key ``scene``, with all fields that affect the result, including defaults.
    """
    shared: dict[str, Any] = {"versions": versions(), "processor": processor()}
    if scene is not None:
        shared["scene"] = scene.canonical_fields
    return {"schema": SCHEMA, **plain, **{k: v for k, v in shared.items() if k not in plain}}


def json_text(plain: Mapping[str, Any], scene: "Scene | None" = None) -> str:
    """Return an object as one line of JSON; raise ValueError for nan and inf."""
    return json.dumps(stamped(plain, scene), allow_nan=False)


_AS_THEY_ARE = {str, int, bool, type(None)}


def finite(value: Any) -> Any:
    """Return a value of plain types in which None replaces numbers that are not finite."""
    if type(value) in _AS_THEY_ARE:
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [finite(inner) for inner in value]
    return value
