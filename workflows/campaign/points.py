"""Define the points of a sweep, which are numbered and created on request."""

import itertools
import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from chaincor.lammps_inputs.errors import PotentialError, SceneError
from chaincor.lammps_inputs.given_numbers import shown
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import EXCLUDED
from chaincor.lammps_inputs.scene_parts.scene_file import from_folder
from chaincor.workflows.campaign.axes import Axis, ValuesAxis, fields_of, merged
from chaincor.workflows.errors import SweepError

# If an axis has at most this many values, all of them are checked before a large sweep begins.
_MOST_TRIED = 1000
# If an axis sets one parameter of a formula, its name begins with this text.
PARAMETER_AXIS = "parameters."


class SweepPoints(Sequence[Scene]):
    """
    Points of a sweep with crossed axes, as scenes that are created on request.

    Each of the `groups` is an axis, or several axes that move together. A group gives the fields of
    the `base` scene that each of its values sets. Different groups set different fields, and the
    last group varies fastest. Relative paths start at `folder`, the folder of the sweep file.
    """

    def __init__(self, base: dict[str, Any], groups: Sequence[Axis], folder: Path) -> None:
        self.base, self.groups, self._folder = base, tuple(groups), folder

    def __len__(self) -> int:
        return math.prod(len(group) for group in self.groups)

    def __getitem__(self, index: Any) -> Any:
        numbers = range(len(self))[index]
        if isinstance(numbers, range):
            return tuple(self._scene(number) for number in numbers)
        return self._scene(numbers)

    def fields(self, number: int) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return all fields of a point, and the fields that axes set."""
        parts, rest = [], number
        for group in reversed(self.groups):
            rest, place = divmod(rest, len(group))
            parts.append(group[place])
        point = merged(*reversed(parts))
        # If a key of the base scene contradicts an axis, the key is dropped.
        dropped = {other for key in point for other in EXCLUDED.get(key, ())}
        return {key: value for key, value in self.base.items() if key not in dropped} | point, point

    def point(self, number: int) -> "Point":
        """Return a point without creating its scene."""
        fields, own = self.fields(number)
        return Point(number, fields, tuple(own), self._folder)

    def _scene(self, number: int) -> Scene:
        return self.point(number).scene()

    def check(self) -> None:
        """
        Create some scenes, so that most mistakes are found before the computation starts.

        All values of a short axis are tried once, and both ends of a long axis. Raise SceneError if
        a point has no valid scene.
        """
        each = 1
        for group in reversed(self.groups):
            size = len(group)
            for place in range(size) if size <= _MOST_TRIED else (0, size - 1):
                self._scene(place * each)
            each *= size


class Point(NamedTuple):
    """One point of a sweep. Workers get the point instead of its scene."""

    number: int  #: Number of the point, counted from 0.
    fields: dict[str, Any]  #: Fields of the scene.
    own: tuple[str, ...]  #: Fields that axes set.
    folder: Path  #: Folder at which relative paths start.

    def scene(self) -> Scene:
        """
        Return the scene.

        Raise SceneError, with the number of the point, if the fields form no valid scene.
        """
        fields = dict(self.fields)
        _fold_parameters(fields)
        try:
            return Scene(**from_folder(fields, self.folder))
        except (PotentialError, SceneError) as error:
            values = ", ".join(f"{key} = {shown(self.fields[key])}" for key in self.own)
            raise SceneError(
                f"point {self.number + 1} ({values or 'the base scene'}): {error}"
            ) from None

    def speed_and_others(self) -> tuple[str, Hashable]:
        """
        Return the key of the speed, and a key that is equal for points with equal other fields.

        The second key is None if a point must be compared in another way.
        """
        key = "speed" if "speed" in self.fields else "velocity"
        others = [(name, value) for name, value in self.fields.items() if name != key]
        plain = all(isinstance(value, str | int | float) for _, value in others)
        # `repr` distinguishes equal values of different types, such as 1 and True, of which only
        # one may be valid.
        return key, repr((self.folder, others)) if plain and key in self.fields else None


def scene_of(given: Scene | Point) -> Scene:
    """Return the scene of a point; return a scene unchanged."""
    return given.scene() if isinstance(given, Point) else given


def scenes_of(given: Iterable[Scene | Point]) -> list[Scene]:
    """Return the scenes of points; points that differ only in their speed share all other parts."""
    firsts: dict[Hashable, Scene] = {}
    found = []
    for each in given:
        if isinstance(each, Scene):
            found.append(each)
            continue
        key, others = each.speed_and_others()
        first = firsts.get(others)
        if first is None:
            found.append(each.scene())
            if others is not None:
                firsts[others] = found[-1]
            continue
        try:
            found.append(first.at_speed(key, each.fields[key]))
        except (PotentialError, SceneError):
            found.append(each.scene())  # raises the error with the number of the point
    return found


def _fold_parameters(fields: dict[str, Any]) -> None:
    """
    Move ``parameters.a`` into the table ``parameters``.

    A scene itself refuses invalid values.
    """
    single = {key: fields.pop(key) for key in list(fields) if str(key).startswith(PARAMETER_AXIS)}
    base = fields.get("parameters", {})
    if single and isinstance(base, dict):
        own = {key.removeprefix(PARAMETER_AXIS): value for key, value in single.items()}
        fields["parameters"] = base | own


def refuse_shared_fields(axes: Mapping[str, Axis], together: Sequence[Sequence[str]] = ()) -> None:
    """
    Raise SweepError if two axes set the same field at the same point.

    The message names the axes and the field. Axes that move `together` are equally long, and only
    their values at equal positions combine.
    """
    fields = {name: _fields(axis) for name, axis in axes.items()}
    for one, other in itertools.combinations(axes, 2):
        shared = fields[one] & fields[other]
        if shared and any({one, other} <= {*names} for names in together):
            pairs = zip(axes[one], axes[other], strict=True)
            shared = {field for a, b in pairs for field in _fields([a]) & _fields([b])}
        if shared:
            raise SweepError(
                f"axes '{one}' and '{other}' both set {' and '.join(sorted(shared))}. Set each "
                "field by one axis only"
            )


def value_of(scene: Scene, axis: str) -> Any:
    """Return the value that a scene has on an axis; None if it has none."""
    if axis.startswith(PARAMETER_AXIS):
        return (scene.parameters or {}).get(axis.removeprefix(PARAMETER_AXIS))
    return getattr(scene, axis, None)


def fields_set(axes: Mapping[str, Axis]) -> list[str]:
    """Return the fields that the values of an axis set, each once, in the order of first use."""
    return list(dict.fromkeys(key for axis in axes.values() for key in fields_of(axis)))


def _fields(axis: Axis) -> set[str]:
    """Return the fields that an axis sets; each parameter of a formula is a field of its own."""
    if isinstance(axis, ValuesAxis) and axis.name != "parameters":
        return {axis.name}
    found: set[str] = set()
    for entry in axis:
        found |= entry.keys()
        if isinstance(inner := entry.get("parameters"), Mapping):
            found |= {f"{PARAMETER_AXIS}{name}" for name in inner}
    return found
