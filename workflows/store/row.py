"""
Convert the result or failure of a collision to a row of a results store, and back.

Rows also decide which of them answers a scene, and which of two replaces the other.
"""

import io
import json
import math
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property, lru_cache
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError, SceneError, one_line
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.identity import canonical_json, hash_of
from chaincor.workflows.errors import MissingLibraryError, RunError, WorkerDiedError
from chaincor.workflows.json_output import finite
from chaincor.workflows.result import Collision
from chaincor.workflows.store.schema import (
    FAILURE_COLUMNS,
    FLAG_COLUMNS,
    RESULT_COLUMNS,
    SCENE_COLUMNS,
)
from chaincor.workflows.store.short_scene import short_scene, whole_scene


class HasTolerance(Protocol):
    """Scene or requested collision."""

    @property
    def asked_tolerance(self) -> float | None:
        """Tolerance of eta; None with explicit numerics."""


class Failure(NamedTuple):
    """Failure of a collision."""

    name: str  #: Class of the error.
    message: str  #: Message of the error, in one line.
    #: Whether the same scene would fail again and is repeated only on request. The value is true
    #: for named errors of the collision itself, and false for errors of the machine.
    stands: bool


@dataclass(frozen=True)
class Row:
    """
    Row of a results store.

    A worker fills the columns that describe the result. The store fills the key and the columns
    that describe the scene.

    The tolerance of a row is the tightest requested tolerance that the result meets, or for which
    no run could give a better result. The tolerance is None if the scene has explicit numerics.
    """

    #: Known columns of the schema. A row from a store also has the columns ``collision_sha256``
    #: (its key), ``tries``, ``host``, ``finished`` (UTC, ISO 8601) and ``has_arrays`` (whether the
    #: store has its arrays).
    columns: Mapping[str, Any]
    #: Arrays by name: ``contact_times``, ``contact_speeds``, ``mode_energies``, ``velocities`` and
    #: ``displacements``. For a free target, the last three also exist with the prefix ``target_``.
    #: Empty if the arrays were not stored or not requested.
    arrays: dict[str, NDArray[np.float64]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, found: Collision | BaseException, *, arrays: bool = True) -> Self:
        """Return the row for a result, with its arrays on request, or for a failure."""
        if isinstance(found, Collision):
            return cls.of_fields(found.plain(), found.arrays() if arrays else None)
        passing = isinstance(found, MissingLibraryError | WorkerDiedError)
        stands = isinstance(found, RunError | InputError) and not passing
        message = one_line(found) or type(found).__name__
        values = (type(found).__name__, message, None, int(stands))
        return cls(dict(zip(FAILURE_COLUMNS, values, strict=True)) | {"host": host_name()})

    @classmethod
    def of_fields(
        cls, fields: dict[str, Any], arrays: dict[str, NDArray[np.float64]] | None = None
    ) -> Self:
        """
        Return the row for the fields of a result.

        Fields without a column go to ``details``. Fields of the scene, such as the velocity, are
        omitted, because :meth:`of_scene` adds them.
        """
        columns = {"versions": _versions_json(tuple(fields.pop("versions").items()))}
        columns |= {name: finite(fields.pop(name, None)) for name in RESULT_COLUMNS}
        for name in (*_OF_SCENES, "scene_sha256"):
            fields.pop(name, None)
        return cls(columns | {"details": _json(fields), "host": host_name()}, arrays or {})

    def of_scene(self, scene: Scene) -> Self:
        """Return the row, with its key and the columns of its scene added."""
        columns = {**self.columns, **_scene_columns(scene)}
        if not self.has_result:
            asked = scene.asked_tolerance
            columns |= {"failure_tolerance": asked, "tolerance": asked}
        columns["scene"] = short_scene(scene.canonical_fields, columns)
        return type(self)(columns, self.arrays)

    def without_details(self) -> Self:
        """Return the row without the details of its result, which take half of its space."""
        return type(self)({**self.columns, "details": None}, self.arrays)

    @cached_property
    def scene(self) -> dict[str, Any]:
        """Canonical scene, with the tolerance of the run that gave the result."""
        return whole_scene(json.loads(self.columns["scene"]), self.columns)

    @cached_property
    def result(self) -> dict[str, Any] | None:
        """
        Fields of a :class:`~chaincor.workflows.result.Collision` without the arrays.

        The value is None if no run has succeeded. In a row without details, fields without a column
        are missing. ``tolerance_met`` and ``reason`` refer to the tolerance of the row.
        """
        columns = self.columns
        if not self.has_result:
            return None
        fields = {name: columns[name] for name in (*RESULT_COLUMNS, *_OF_SCENES)}
        fields["scene_sha256"] = hash_of(canonical_json(self.scene))
        for name in FLAG_COLUMNS:
            if fields.get(name) is not None:
                fields[name] = bool(fields[name])
        details = {} if columns["details"] is None else json.loads(columns["details"])
        return fields | {"versions": json.loads(columns["versions"])} | details

    @property
    def failure(self) -> Failure | None:
        """Last failure after the result was stored; None if there was none."""
        name, message, _, stands = (self.columns.get(name) for name in FAILURE_COLUMNS)
        return None if name is None else Failure(name, str(message), bool(stands))

    @property
    def restitution(self) -> float:
        """Ratio of energies, eta; NaN without a result."""
        eta = self.columns.get("restitution")
        return float("nan") if eta is None else eta

    @property
    def restitution_error(self) -> float | None:
        """Error bar of eta; None if there is none."""
        return self.columns.get("restitution_error")

    @property
    def has_result(self) -> bool:
        """Whether a run has succeeded."""
        return self.columns.get("restitution") is not None

    @property
    def reached(self) -> float:
        """Error bar of the result; inf if there is none."""
        return math.inf if self.restitution_error is None else self.restitution_error

    def answers(self, scene: HasTolerance, *, arrays: bool = False) -> bool:
        """
        Return whether the result is accurate enough for a scene.

        The result must meet the scene's tolerance, or its run must have had an equal or tighter
        tolerance. If the scene has explicit numerics, any result is accurate enough. Runs with and
        without an error bar have separate rows.
        """
        if not self.has_result or (arrays and not self.columns["has_arrays"]):
            return False
        return scene.asked_tolerance is None or self.reaches(scene.asked_tolerance)

    def reaches(self, tolerance: float) -> bool:
        """Return whether the result meets a tolerance, or its run had one at least as tight."""
        known = self.columns["tolerance"]
        return self.reached <= tolerance or (known is not None and known <= tolerance)

    def would_fail(self, scene: HasTolerance) -> bool:
        """
        Return whether a scene would fail again.

        A scene would fail again if it failed with the same or a looser tolerance.
        """
        if not self.columns["failure_stands"]:
            return False
        asked, failed = scene.asked_tolerance, self.columns["failure_tolerance"]
        return asked is None or failed is None or asked <= failed

    def yields_to(self, other: "Row", *, renew: bool = False) -> bool:
        """
        Return whether another row for the same collision replaces this row.

        A result replaces a failure, and a later failure replaces an earlier one. A result replaces
        another result if its error bar is smaller; a missing error bar counts as infinite. If the
        error bars are equal, a result with arrays replaces a result without them.

        `renew` means that the other row was computed to replace this row, on request or because
        arrays were missing. The other row then replaces this row if its tolerance is equal or
        tighter, whatever its error bar is. A result without an error bar never replaces a result
        with an error bar.
        """
        if not other.has_result:
            return not self.has_result and other.columns["finished"] > self.columns["finished"]
        if not self.has_result:
            return True
        loses_bar = math.isfinite(self.reached) and not math.isfinite(other.reached)
        if renew and not loses_bar and not self._asked_more_exactly_than(other):
            return True
        mine, others = ((row.reached, not row.columns["has_arrays"]) for row in (self, other))
        return others < mine

    def _asked_more_exactly_than(self, other: "Row") -> bool:
        asked, others = self.columns["tolerance"], other.columns["tolerance"]
        # Without a tolerance, the numerics are explicit, and every run gives the same result.
        return asked is not None and others is not None and asked < others

    def tightened_by(self, other: "Row") -> dict[str, Any]:
        """
        Return the columns to change if this row stays but the other's tolerance is tighter.

        The row then gets the tighter tolerance, even if its result does not meet it. Otherwise a
        sweep with this tolerance would repeat the run every time.
        """
        both = self.has_result and other.has_result
        if not (both and other._asked_more_exactly_than(self)):
            return {}
        asked = other.columns["tolerance"]
        met = self.reached <= asked
        missed = (
            f"the error reached is {self.reached:.2g}, not {asked:g}, and a run at that tolerance "
            "reached no smaller error"
        )
        return {"tolerance": asked, "tolerance_met": met, "reason": None if met else missed}


# Fields of a result that are stored in the columns of the scene.
_OF_SCENES = ("potential", "particles", "engine")


def _json(fields: dict[str, Any]) -> str:
    try:
        return canonical_json(fields)
    except ValueError:
        return canonical_json(finite(fields))


@lru_cache(maxsize=16)
def _versions_json(items: tuple[tuple[str, str], ...]) -> str:
    return canonical_json(dict(items))


@cache
def host_name() -> str:
    """Return the network name of this machine, or ``unknown``."""
    return platform.node() or "unknown"


def row_key(scene: Scene) -> str:
    """
    Return the key of a scene's row, the SHA-256 of the canonical scene without its tolerance.

    Raise SceneError if the potential is a Python object.
    """
    if isinstance(scene.potential, Potential):
        raise SceneError(
            f"potential '{scene.label}' is a Python object, which a store cannot tell from "
            "another object with this name. Use a named potential or 'table' with a "
            "bond_file"
        )
    return scene.collision_sha256


def _scene_columns(scene: Scene) -> dict[str, Any]:
    """Return the columns of a row that describe its scene, without the column ``scene``."""
    canonical = scene.canonical_fields
    columns = {name: canonical.get(name) for name in SCENE_COLUMNS}
    # A given speed is kept. A computed v0/v* may differ in the last digit and would split rows of
    # equal speed into several groups.
    speed, scale = scene.speed, scene.bond.natural_speed
    if speed is None and scale is not None:
        speed = scene.impact_velocity / scale
    return columns | {
        "speed": speed,
        "collision_sha256": row_key(scene),
        "velocity": scene.impact_velocity,
    }


def array_to_bytes(array: NDArray[np.float64]) -> bytes:
    """Write an array in NumPy's ``.npy`` format."""
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()


def array_from_bytes(content: bytes) -> NDArray[np.float64]:
    """Read an array of floats in NumPy's ``.npy`` format; raise ValueError for other content."""
    array = np.load(io.BytesIO(content), allow_pickle=False)
    if not (isinstance(array, np.ndarray) and array.dtype.kind == "f"):
        raise ValueError("no array of numbers")
    return array
