"""The columns of a row, from a scene and a result and back."""

import io
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.store.attempt import Failure
from chaincor.workflows.store.schema import FLAG_COLUMNS, RESULT_COLUMNS, SCENE_COLUMNS
from chaincor.workflows.store.stored_collision import StoredCollision


def row_key(scene: Scene) -> str:
    """
    Return the key of a scene's row: SHA-256 of the canonical scene without its tolerance.

    Raises SceneError if its potential is a Python object.
    """
    if isinstance(scene.potential, Potential):
        raise SceneError(
            f"potential '{scene.label}' is a Python object, which a store cannot tell from another "
            "of the same name; expected a named potential or 'table' with a bond_file"
        )
    return scene.collision_sha256


def scene_columns(scene: Scene) -> dict[str, Any]:
    """Return the columns that a scene fills."""
    canonical = scene.canonical_fields
    columns = {name: canonical.get(name) for name in SCENE_COLUMNS}
    # The speed as it was given: v0/v* may differ from it in the last digit, which would split
    # the rows of one speed into several.
    speed, scale = scene.speed, scene.bond.natural_speed
    if speed is None and scale is not None:
        speed = scene.impact_velocity / scale
    return columns | {
        "speed": speed,
        "collision_sha256": row_key(scene),
        "scene_sha256": scene.sha256,
        "velocity": scene.impact_velocity,
        "scene": scene.canonical_json,
    }


def stored_collision(
    columns: dict[str, Any], arrays: dict[str, NDArray[np.float64]]
) -> StoredCollision:
    """Return what a row holds."""
    failure = None
    if columns["failure"] is not None:
        failure = Failure(
            columns["failure"], columns["failure_message"], bool(columns["failure_stands"])
        )
    return StoredCollision(
        collision_sha256=columns["collision_sha256"],
        scene=json.loads(columns["scene"]),
        result=_result(columns),
        failure=failure,
        failure_tolerance=columns["failure_tolerance"],
        tries=columns["tries"],
        host=columns["host"],
        finished=columns["finished"],
        has_arrays=bool(columns["has_arrays"]),
        arrays=arrays,
    )


def _result(columns: dict[str, Any]) -> dict[str, Any] | None:
    """Return the fields as :meth:`chaincor.workflows.result.Collision.to_dict` gave them."""
    if columns["restitution"] is None:
        return None
    fields = {name: columns[name] for name in RESULT_COLUMNS}
    for name in FLAG_COLUMNS:
        if fields.get(name) is not None:
            fields[name] = bool(fields[name])
    fields |= {name: columns[name] for name in ("potential", "particles", "engine", "scene_sha256")}
    fields["versions"] = json.loads(columns["versions"])
    return fields | json.loads(columns["details"])


def array_to_bytes(array: NDArray[np.float64]) -> bytes:
    """Write an array in NumPy's own format, that of ``.npy`` files."""
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()


def array_from_bytes(content: bytes) -> NDArray[np.float64]:
    """Read an array from NumPy's own format."""
    return np.load(io.BytesIO(content), allow_pickle=False)
