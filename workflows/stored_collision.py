"""A row of a results store: what it looks like in Python and in SQLite."""

import io
import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lammps_inputs.scene import DEFAULT_TOLERANCE, Scene
from workflows.attempt import Failure
from workflows.result import Collision
from workflows.store_schema import FLAG_COLUMNS, RESULT_COLUMNS, SCENE_COLUMNS


@dataclass(frozen=True)
class StoredCollision:
    """
    One row of a results store.

    Attributes
    ----------
    collision_sha256 : str
        Key of the row: hash of the scene without its tolerance.
    scene : dict
        The canonical scene.
    result : dict or None
        The fields of a :class:`~workflows.result.Collision` but for the arrays; None where no try
        has succeeded.
    failure : Failure or None
        The last failure since the result.
    failure_tolerance : float or None
        The tolerance that was asked for when it failed.
    tries : int
        How often it was carried out.
    host : str
        Where.
    finished : str
        When: UTC, ISO 8601.
    arrays : dict
        Names and arrays: ``contact_times``, ``contact_speeds``, ``mode_energies``, ``velocities``
        and ``displacements``; empty where they were not kept or not asked for.
    has_arrays : bool
        Whether the store keeps the arrays of this row.
    """

    collision_sha256: str
    scene: dict[str, Any]
    result: dict[str, Any] | None
    failure: Failure | None
    failure_tolerance: float | None
    tries: int
    host: str
    finished: str
    has_arrays: bool
    arrays: dict[str, NDArray[np.float64]] = field(default_factory=dict, repr=False)

    @property
    def restitution(self) -> float:
        """The ratio of energies, eta; nan where there is no result."""
        return float("nan") if self.result is None else self.result["restitution"]

    @property
    def restitution_error(self) -> float | None:
        """Error bar of eta."""
        return None if self.result is None else self.result["restitution_error"]


@dataclass(frozen=True)
class Standing:
    """
    What a store has on a collision, as far as it decides whether to run it.

    Attributes
    ----------
    restitution, restitution_error, tolerance : float or None
        Of the result.
    failure_tolerance : float or None
        Asked for when it failed.
    failure_stands : bool
        Whether there is a failure that would come again.
    tries : int
        How often it was carried out.
    has_arrays : bool
        Whether the arrays are kept.
    """

    restitution: float | None
    restitution_error: float | None
    tolerance: float | None
    failure_tolerance: float | None
    failure_stands: bool
    tries: int
    has_arrays: bool

    def answers(self, scene: Scene) -> bool:
        """
        Say whether the result is exact enough for a scene.

        Parameters
        ----------
        scene : Scene
            The collision as it is asked for now.

        Returns
        -------
        bool
            True if the same or a smaller error was asked for, or reached. With explicit numerics:
            if there is an error bar or none is wanted.
        """
        if self.restitution is None:
            return False
        if scene.explicit:
            return self.restitution_error is not None or not scene.error
        asked = asked_tolerance(scene)
        assert asked is not None
        reached = self.restitution_error is not None and self.restitution_error <= asked
        return reached or (self.tolerance is not None and self.tolerance <= asked)

    def would_fail(self, scene: Scene) -> bool:
        """
        Say whether a scene is known to fail.

        Parameters
        ----------
        scene : Scene
            The collision as it is asked for now.

        Returns
        -------
        bool
            True if it failed by itself when no smaller an error was asked for.
        """
        if not self.failure_stands:
            return False
        asked = asked_tolerance(scene)
        return asked is None or self.failure_tolerance is None or asked <= self.failure_tolerance


def asked_tolerance(scene: Scene) -> float | None:
    """
    Return the error asked of eta.

    Parameters
    ----------
    scene : Scene
        The collision.

    Returns
    -------
    float or None
        None with explicit numerics.
    """
    return None if scene.explicit else scene.tolerance or DEFAULT_TOLERANCE


def scene_columns(scene: Scene) -> dict[str, Any]:
    """
    Return the columns that a scene fills.

    Parameters
    ----------
    scene : Scene
        The collision.

    Returns
    -------
    dict
        Names and values.
    """
    canonical = scene.canonical_fields
    columns = {name: canonical.get(name) for name in SCENE_COLUMNS}
    # The speed as it was given: v0/v* may differ from it in the last digit, which would split
    # the rows of one speed into several.
    speed, scale = scene.speed, scene.bond.natural_speed
    if speed is None and scale is not None:
        speed = scene.impact_velocity / scale
    return columns | {
        "speed": speed,
        "collision_sha256": scene.collision_sha256,
        "scene_sha256": scene.sha256,
        "velocity": scene.impact_velocity,
        "scene": json.dumps(canonical, sort_keys=True),
    }


def result_columns(collision: Collision) -> tuple[dict[str, Any], str]:
    """
    Return the columns that a result fills.

    Parameters
    ----------
    collision : Collision
        The result.

    Returns
    -------
    columns : dict
        Names and values, apart from the versions.
    versions : str
        The versions as JSON, for the table of environments.
    """
    fields = collision.to_dict()
    versions = json.dumps(fields.pop("versions"), sort_keys=True)
    columns = {name: fields.pop(name) for name in RESULT_COLUMNS}
    for name in ("potential", "particles", "engine", "scene_sha256"):
        del fields[name]  # the scene's columns hold them
    columns["details"] = json.dumps(fields, sort_keys=True)
    return columns, versions


def result_from_columns(columns: dict[str, Any]) -> dict[str, Any] | None:
    """
    Return the fields of a result from the columns of its row.

    Parameters
    ----------
    columns : dict
        All columns, and ``versions``.

    Returns
    -------
    dict or None
        As :meth:`workflows.result.Collision.to_dict` gave them.
    """
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
    """
    Write an array in NumPy's own format.

    Parameters
    ----------
    array : ndarray
        Any shape.

    Returns
    -------
    bytes
        The contents of a ``.npy`` file.
    """
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()


def array_from_bytes(content: bytes) -> NDArray[np.float64]:
    """
    Read an array from NumPy's own format.

    Parameters
    ----------
    content : bytes
        The contents of a ``.npy`` file.

    Returns
    -------
    ndarray
        The array.
    """
    return np.load(io.BytesIO(content), allow_pickle=False)
