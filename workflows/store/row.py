"""One row of a results store: what is known of one collision, a result or why there is none."""

import io
import json
import math
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property, lru_cache
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError, SceneError, one_line
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import MissingLibraryError, RunError, WorkerDiedError
from chaincor.workflows.json_output import finite
from chaincor.workflows.result import Collision
from chaincor.workflows.store.schema import (
    FAILURE_COLUMNS,
    FLAG_COLUMNS,
    RESULT_COLUMNS,
    SCENE_COLUMNS,
)


class Failure(NamedTuple):
    """Why a collision has no result."""

    name: str  #: Class of the error.
    message: str  #: One line.
    #: Whether the same scene would fail again: then it is tried anew only on request. That is so
    #: for named errors of the collision itself, not for those of the machine.
    stands: bool


@dataclass(frozen=True)
class Row:
    """
    One row of a results store; a worker makes it, a store adds what tells rows apart.

    Its tolerance is the tightest that has been asked of the collision and that the result stands
    for: it meets it, or no run has come closer. None with explicit numerics.
    """

    #: As ``schema`` has them, as far as they are known: of a row of a store also
    #: ``collision_sha256``, its key, ``tries``, ``host`` and ``finished`` (UTC, ISO 8601), and
    #: ``has_arrays``, whether the store keeps its arrays.
    columns: Mapping[str, Any]
    #: Names and arrays: ``contact_times``, ``contact_speeds``, ``mode_energies``, ``velocities``
    #: and ``displacements``, the last three also of a free target (``target_...``); empty where
    #: they were not kept or not asked for.
    arrays: dict[str, NDArray[np.float64]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, found: Collision | BaseException) -> Self:
        """Return what a store keeps of a result, or of a failure."""
        if isinstance(found, Collision):
            return cls.of_fields(found.plain(), found.arrays())
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
        Return what a store keeps of the fields of a result; what has no column is a detail.

        What the scene says, as velocity and speed, it is recorded with.
        """
        columns = {"versions": _versions_json(tuple(fields.pop("versions").items()))}
        columns |= {name: finite(fields.pop(name, None)) for name in RESULT_COLUMNS}
        for name in _OF_SCENES:
            fields.pop(name, None)
        return cls(columns | {"details": _json(fields), "host": host_name()}, arrays or {})

    @cached_property
    def scene(self) -> dict[str, Any]:
        """The canonical scene, with the tolerance of the run that gave the result."""
        return json.loads(self.columns["scene"])

    @cached_property
    def result(self) -> dict[str, Any] | None:
        """
        The fields of a :class:`~chaincor.workflows.result.Collision` but for the arrays.

        None where no try has succeeded. ``tolerance_met`` and ``reason`` are by its tolerance.
        """
        columns = self.columns
        if not self.has_result:
            return None
        fields = {name: columns[name] for name in (*RESULT_COLUMNS, *_OF_SCENES)}
        for name in FLAG_COLUMNS:
            if fields.get(name) is not None:
                fields[name] = bool(fields[name])
        return (
            fields | {"versions": json.loads(columns["versions"])} | json.loads(columns["details"])
        )

    @property
    def failure(self) -> Failure | None:
        """The last failure since the result."""
        name, message, _, stands = (self.columns.get(name) for name in FAILURE_COLUMNS)
        return None if name is None else Failure(name, str(message), bool(stands))

    @property
    def restitution(self) -> float:
        """The ratio of energies, eta; nan where there is no result."""
        eta = self.columns.get("restitution")
        return float("nan") if eta is None else eta

    @property
    def restitution_error(self) -> float | None:
        """Error bar of eta."""
        return self.columns.get("restitution_error")

    @property
    def has_result(self) -> bool:
        """Whether a try has succeeded."""
        return self.columns.get("restitution") is not None

    @property
    def reached(self) -> float:
        """The error bar of the result; inf without one."""
        return math.inf if self.restitution_error is None else self.restitution_error

    def answers(self, scene: Scene, *, arrays: bool = False) -> bool:
        """
        Say whether the result is exact enough for a scene.

        That is if the same or a smaller error was asked for, or reached. With explicit numerics any
        result is: runs with and without an error bar have rows of their own.
        """
        if not self.has_result or (arrays and not self.columns["has_arrays"]):
            return False
        asked, known = scene.asked_tolerance, self.columns["tolerance"]
        return asked is None or self.reached <= asked or (known is not None and known <= asked)

    def would_fail(self, scene: Scene) -> bool:
        """Say whether a scene failed by itself when no smaller an error was asked for."""
        if not self.columns["failure_stands"]:
            return False
        asked, failed = scene.asked_tolerance, self.columns["failure_tolerance"]
        return asked is None or failed is None or asked <= failed

    def yields_to(self, other: "Row", *, renew: bool = False) -> bool:
        """
        Say whether another row of the same collision takes the place of this: the one rule.

        A result takes the place of a failure, a later failure that of an earlier one. Of two
        results the one with the smaller error bar stays, none counting as the largest; of equal
        ones that with arrays; else the one that is there.

        `renew` says that the other was computed to take the place of this, on request or for the
        arrays that this lacks. Then it does so if it was asked for no less exactly, whatever it
        reached; but without an error bar it never takes the place of a result with one.
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
        # With explicit numerics every run is the same.
        return asked is not None and others is not None and asked < others

    def tightened_by(self, other: "Row") -> dict[str, Any]:
        """
        Return what changes in a row that stays if the other was asked for more exactly.

        From then on the row stands for that tolerance, too, whether it meets it or no run came
        closer: else a sweep that asks for it would run it again and again.
        """
        both = self.has_result and other.has_result
        if not (both and other._asked_more_exactly_than(self)):
            return {}
        asked = other.columns["tolerance"]
        met = self.reached <= asked
        missed = (
            f"the error reached is {self.reached:.2g}, not {asked:g}; a run that was "
            "asked for that reached no smaller one"
        )
        return {"tolerance": asked, "tolerance_met": met, "reason": None if met else missed}


# The scene's columns hold them.
_OF_SCENES = ("potential", "particles", "engine", "scene_sha256")
# To make an encoder anew takes as long as to use it.
_write_json = json.JSONEncoder(sort_keys=True, allow_nan=False).encode


def _json(fields: dict[str, Any]) -> str:
    try:
        return _write_json(fields)
    except ValueError:
        return _write_json(finite(fields))


@lru_cache(maxsize=16)
def _versions_json(items: tuple[tuple[str, str], ...]) -> str:
    return _write_json(dict(items))


@cache
def host_name() -> str:
    """Return the name of this machine in the network, ``unknown`` where it has none."""
    return platform.node() or "unknown"


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


def array_to_bytes(array: NDArray[np.float64]) -> bytes:
    """Write an array in NumPy's own format, that of ``.npy`` files."""
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()


def array_from_bytes(content: bytes) -> NDArray[np.float64]:
    """Read an array of numbers from NumPy's own format; ValueError where it is none."""
    array = np.load(io.BytesIO(content), allow_pickle=False)
    if not (isinstance(array, np.ndarray) and array.dtype.kind == "f"):
        raise ValueError("no array of numbers")
    return array
