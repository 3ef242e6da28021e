"""Points of a sweep: numbered, made on request, and divided into shards."""

import itertools
import math
import random
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from chaincor.lammps_inputs.errors import PotentialError, SceneError
from chaincor.lammps_inputs.scene import NUMERICS_KEYS, Scene
from chaincor.lammps_inputs.scene_parts.scene_file import from_folder
from chaincor.workflows.errors import SweepError

# An axis over the key drops these from the base scene, which they would contradict.
_RIVALS = {
    "speed": ("velocity",),
    "velocity": ("speed",),
    "tolerance": NUMERICS_KEYS,
    **dict.fromkeys(NUMERICS_KEYS, ("tolerance",)),
}
# Begins the name of an axis over one parameter of a formula.
PARAMETER_AXIS = "parameters."

Axis = Sequence[Mapping[str, Any]]


class SweepPoints(Sequence[Scene]):
    """
    Crossed axes of a sweep, as scenes that are made on request.

    Each of the `groups` is an axis, or axes that move together: a list with the fields of the
    `base` scene that each value sets. No two groups set one field; the last varies fastest.
    Relative paths start at `folder`, the folder of the sweep file.
    """

    def __init__(
        self, base: dict[str, Any], groups: Sequence[list[dict[str, Any]]], folder: Path
    ) -> None:
        self.base, self.groups, self._folder = base, tuple(groups), folder

    def __len__(self) -> int:
        return math.prod(len(group) for group in self.groups)

    def __getitem__(self, index: Any) -> Any:
        numbers = range(len(self))[index]
        if isinstance(numbers, range):
            return tuple(self._scene(number) for number in numbers)
        return self._scene(numbers)

    def fields(self, number: int) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return all fields of a point, and those that its axes set."""
        parts, rest = [], number
        for group in reversed(self.groups):
            rest, place = divmod(rest, len(group))
            parts.append(group[place])
        point = merged(*reversed(parts))
        dropped = {rival for key in point for rival in _RIVALS.get(key, ())}
        return {key: value for key, value in self.base.items() if key not in dropped} | point, point

    def _scene(self, number: int) -> Scene:
        fields, point = self.fields(number)
        _fold_parameters(fields)
        try:
            return Scene(**from_folder(fields, self._folder))
        except (PotentialError, SceneError) as error:
            shown = ", ".join(f"{key} = {value!r}" for key, value in point.items())
            raise SceneError(f"point {number + 1} ({shown or 'the base scene'}): {error}") from None


def _fold_parameters(fields: dict[str, Any]) -> None:
    """Move ``parameters.a`` into the table ``parameters``; the scene refuses other values."""
    single = {key: fields.pop(key) for key in list(fields) if str(key).startswith(PARAMETER_AXIS)}
    base = fields.get("parameters", {})
    if single and isinstance(base, dict):
        own = {key.removeprefix(PARAMETER_AXIS): value for key, value in single.items()}
        fields["parameters"] = base | own


def merged(*parts: dict[str, Any]) -> dict[str, Any]:
    """Join the fields that several axes set."""
    return {key: value for part in parts for key, value in part.items()}


def shard(points: SweepPoints, number: int, count: int) -> tuple[Scene, ...]:
    """
    Return part `number`, from 1, of `count` disjoint parts of a sweep, for job arrays.

    Only the points of the part are made. A part is the same on every machine. Parts have equally
    many points of every chain length, scattered over the other axes, so they take about equally
    long. Raises SweepError if there is no such part.
    """
    if not 1 <= number <= count:
        raise SweepError(
            f"shard {number}/{count} does not exist; expected 1/{count} to {count}/{count}"
        )
    # Points that differ only in their tolerance share a row, and therefore a part.
    cells: dict[str, list[int]] = {}
    lengths: dict[str, str] = {}
    for place in range(len(points)):
        fields, _ = points.fields(place)
        fields.pop("tolerance", None)
        cells.setdefault(key := repr(sorted(fields.items())), []).append(place)
        lengths[key] = repr(fields.get("particles"))
    # The order is the same in every version of Python.
    chance = random.Random(0)
    order = sorted(cells, key=lambda key: (lengths[key], chance.random()))
    return tuple(
        points[k] for k in sorted(k for key in order[number - 1 :: count] for k in cells[key])
    )


def refuse_shared_fields(axes: Mapping[str, Axis], together: Sequence[Sequence[str]] = ()) -> None:
    """
    Raise SweepError, which names axes and field, if two axes set one field at one point.

    Axes that move `together` are equally long, and only values at equal positions combine.
    """
    fields = {name: _fields(axis) for name, axis in axes.items()}
    for one, other in itertools.combinations(axes, 2):
        shared = fields[one] & fields[other]
        if shared and any({one, other} <= {*names} for names in together):
            pairs = zip(axes[one], axes[other], strict=True)
            shared = {field for a, b in pairs for field in _fields([a]) & _fields([b])}
        if shared:
            raise SweepError(
                f"axes '{one}' and '{other}' both set {' and '.join(sorted(shared))}; expected one "
                "axis for each field: leave it out of one of them"
            )


def value_of(scene: Scene, axis: str) -> Any:
    """Return the value of a scene on an axis; None if it has none."""
    if axis.startswith(PARAMETER_AXIS):
        return (scene.parameters or {}).get(axis.removeprefix(PARAMETER_AXIS))
    return getattr(scene, axis, None)


def fields_set(axes: Mapping[str, Axis]) -> list[str]:
    """Return every key that a value of an axis sets, each once, in their order."""
    return list(dict.fromkeys(key for axis in axes.values() for entry in axis for key in entry))


def _fields(axis: Axis) -> set[str]:
    """Return the fields that an axis sets, with each parameter of a formula by its own name."""
    found: set[str] = set()
    for entry in axis:
        found |= entry.keys()
        if isinstance(inner := entry.get("parameters"), Mapping):
            found |= {f"{PARAMETER_AXIS}{name}" for name in inner}
    return found
