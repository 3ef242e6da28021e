"""Read sweep files, which give a base scene and axes over its fields."""

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from chaincor.lammps_inputs.bonds.potentials import WHOLE_KEYS
from chaincor.lammps_inputs.scene import FILE_KEYS, Scene
from chaincor.lammps_inputs.scene_parts.scene_file import (
    MASSES_READ,
    from_folder,
    read_scene_fields,
)
from chaincor.workflows.campaign.axes import Axis, Spaced, ValuesAxis, ZippedAxis, spaced
from chaincor.workflows.campaign.points import (
    PARAMETER_AXIS,
    SweepPoints,
    fields_set,
    refuse_shared_fields,
)
from chaincor.workflows.errors import SweepError

_KEYS = ("scene", "axes", "zip", "store", "arrays", "details")
_RANGE_KEYS = {"from", "to", "points", "step", "spacing"}
_SPACINGS = ("linear", "log")
_WHOLE = ("particles", "target_particles", *WHOLE_KEYS, "table_points")
# Largest number of values on an axis with whole numbers.
_MOST_WHOLE = 10_000_000
# Largest number of values on an axis, and of points in a sweep. Python limits the length of
# sequences.
_MOST_VALUES = 2**62


@dataclass(frozen=True)
class Sweep:
    """Sweep that was read from a file and checked."""

    scenes: SweepPoints  #: Points of the sweep.
    axes: dict[str, int]  #: Name of each axis, and its number of values.
    store: Path  #: File for the results.
    arrays: bool  #: Whether to store contacts, mode energies and final states.
    details: bool  #: Whether to store the details of each result.


def is_sweep(path: Path) -> bool:
    """Return whether a file describes a sweep instead of a scene."""
    return not {"scene", "axes"}.isdisjoint(read_scene_fields(path))


def read_sweep(path: Path | str) -> Sweep:
    """
    Read a sweep file, in TOML.

    ``[scene]`` is the base scene, and each key in ``[axes]`` is an axis. An axis has the name of
    the field that it sets. Its values are a list, or a range ``{from, to, points | step, spacing =
    "linear" | "log"}``. An axis ``masses`` needs a list of lists, and a range of ``seed`` is
    ``{from, to}``. If the values are tables, each of them sets several fields. An axis
    ``parameters.a`` sets one parameter of a formula.

    ``zip = [["particles", "speed"]]`` makes axes move together. ``store`` is the file for the
    results, ``arrays`` stores arrays, and ``details = false`` drops the details of results.
    Relative paths start at the folder of the sweep file.

    Raise SweepError if an axis is invalid, and SceneError if the file cannot be read. If a point
    has no valid scene, SceneError is raised later, when its scene is created.
    """
    path = Path(path)
    fields = read_scene_fields(path)
    unknown = [key for key in fields if key not in _KEYS]
    if unknown:
        raise SweepError(
            f"unknown key '{unknown[0]}' in {path}. Use {', '.join(_KEYS)}, and put fields "
            "of the scene under [scene] or [axes]"
        )
    base, axes = _table(fields, "scene"), _table(fields, "axes")
    inner = axes.pop("parameters", {}) if isinstance(axes.get("parameters"), dict) else {}
    for name, axis in inner.items():
        if (whole := f"{PARAMETER_AXIS}{name}") in axes:
            raise SweepError(
                f"axis '{whole}' is given twice, with quotes and without. Leave one out"
            )
        axes[whole] = axis
    values = read_axes(base, axes, "use arrays = true beside [scene], or --keep-jobs DIR")
    base = from_folder(base, path.parent)
    kept = {"arrays": fields.get("arrays", False), "details": fields.get("details", True)}
    for key, value in kept.items():
        if not isinstance(value, bool):
            raise SweepError(f"{key} is {value!r}. Give true or false")
    store = fields.get("store", f"{path.stem}.sqlite")
    if not isinstance(store, str):
        raise SweepError(f"store is {store!r}. Give the name of a file")
    return Sweep(
        scenes=SweepPoints(base, _groups(values, fields.get("zip", [])), path.parent),
        axes={name: len(axis) for name, axis in values.items()},
        store=path.parent / store,
        **kept,
    )


def _table(fields: dict[str, Any], key: str) -> dict[str, Any]:
    table = fields.get(key, {})
    if not isinstance(table, dict):
        raise SweepError(f"{key} is {table!r}. Give a table [{key}]")
    return dict(table)


def read_axes(
    base: dict[str, Any],
    axes: dict[str, Any],
    instead: str,
    listed: Callable[[str, Any], Any] = lambda _name, axis: axis,
) -> dict[str, Axis]:
    """
    Return the fields that each value on each axis sets; raise SweepError for an invalid axis.

    Keys that name files are refused, because all points would write to the same file. The message
    then gives `instead` as the remedy.
    """
    _refuse_outputs({**base, **axes}, instead)
    values = {name: _axis_values(name, listed(name, axis)) for name, axis in axes.items()}
    _refuse_outputs(dict.fromkeys(fields_set(values), True), instead)
    return values


def _refuse_outputs(given: Mapping[str, Any], instead: str) -> None:
    for key in FILE_KEYS:
        if given.get(key) is not None:
            raise SweepError(
                f"'{key}' in a sweep would write every point to one place. Leave it out: {instead}"
            )


def _axis_values(name: str, axis: Any) -> Axis:
    if isinstance(axis, list) and axis and all(isinstance(value, dict) for value in axis):
        # This is the only field whose values are tables.
        return [{name: value} for value in axis] if name == "parameters" else axis
    if name not in Scene.model_fields and not name.startswith(PARAMETER_AXIS):
        raise SweepError(
            f"axis '{name}' is not a field of a scene. Use one of "
            f"{', '.join(Scene.model_fields)}, or a list of tables that set several fields"
        )
    if isinstance(axis, dict):
        return ValuesAxis(name, _range_values(name, axis))
    if not isinstance(axis, list) or not axis:
        raise SweepError(
            f"axis '{name}' is {axis!r}. Give a list, or {{from, to, points}}, or {{from, "
            "to, step}"
        )
    if name in MASSES_READ and any(isinstance(value, int | float) for value in axis):
        # A single value of such a key is itself a list. A list of numbers could therefore mean one
        # chain, or one mass for each of several chains.
        raise SweepError(
            f"axis '{name}' is {axis!r}. Give a list of lists, such as [[1, 2], [1, 3]], or "
            "one value for all points under [scene]"
        )
    return [{name: value} for value in axis]


def _range_values(name: str, axis: dict[str, Any]) -> Sequence[float]:
    def wrong(wanted: str) -> SweepError:
        return SweepError(f"the range of axis '{name}' is {axis!r}. Give {wanted}")

    if name == "seed":
        # Large seeds must be given as whole numbers, because a float cannot represent all of them.
        ends = [axis[key] for key in ("from", "to") if key in axis]
        whole = all(isinstance(end, int) and not isinstance(end, bool) for end in ends)
        if not (len(ends) == len(axis) == 2 and whole and 0 <= ends[1] - ends[0] < _MOST_VALUES):
            raise wrong("two whole numbers, such as { from = 1, to = 200 }")
        return range(ends[0], ends[1] + 1)
    wanted = {"from", "to"} <= set(axis) <= _RANGE_KEYS and ("points" in axis) != ("step" in axis)
    if not wanted:
        raise wrong("from, to, and points or step; spacing goes with points")
    if not all(_is_finite(axis[key]) for key in ("from", "to", "points", "step") if key in axis):
        raise wrong("finite numbers")
    first, last, spacing = float(axis["from"]), float(axis["to"]), axis.get("spacing", "linear")
    if spacing not in _SPACINGS or (spacing == "log" and "step" in axis):
        raise wrong("spacing linear, or log with points")
    values: Sequence[float]
    if "step" in axis:
        step = float(axis["step"])
        count = (last - first) / step * (1.0 + 1e-12) + 1.0 if step else 0.0
        if not 1.0 <= count < _MOST_VALUES:
            raise wrong("a step that leads from the first value to the last")
        values = Spaced(first, step, math.floor(count))
    else:
        points = axis["points"]
        if not isinstance(points, int) or not 1 <= points < _MOST_VALUES:
            raise wrong("a whole number of points, 1 or more")
        if spacing == "log" and not (first > 0 and last > 0):
            raise wrong("values above zero for spacing log")
        values = spaced(first, last, points, log=spacing == "log")
    if name in _WHOLE:
        if len(values) > _MOST_WHOLE:
            raise wrong(f"at most {_MOST_WHOLE} values")
        return [int(value) for value in np.unique(np.rint(values))]
    return values


def _is_finite(value: Any) -> bool:
    """Return whether a value is a finite number that a float can represent."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and abs(value) <= sys.float_info.max


def _groups(values: dict[str, Axis], together: Any) -> list[Axis]:
    """Group the axes that move together; each other axis is a group of its own."""
    if not isinstance(together, list) or not all(
        isinstance(group, list) and all(isinstance(name, str) for name in group)
        for group in together
    ):
        raise SweepError(f"zip is {together!r}. Give lists of axes: [['particles', 'speed']]")
    left = dict(values)
    groups: list[Axis] = []
    for names in together:
        missing = [name for name in names if name not in left]
        if missing or not names:
            raise SweepError(
                f"zip lists {', '.join(map(repr, missing)) or 'nothing'}. List each axis once"
            )
        axes = [left.pop(name) for name in names]
        if len({len(axis) for axis in axes}) > 1:
            sizes = ", ".join(f"{n}: {len(a)}" for n, a in zip(names, axes, strict=True))
            raise SweepError(f"axes that move together have different lengths ({sizes})")
        groups.append(ZippedAxis(axes))
    refuse_shared_fields(values, together)
    groups += left.values()
    count = math.prod(len(group) for group in groups)
    if count > _MOST_VALUES:
        raise SweepError(f"the axes make {count} points. Give at most {_MOST_VALUES}")
    return groups
