"""The fields that the axes of a sweep set; no two may set one, as only one value could hold."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

from chaincor.workflows.errors import SweepError
from chaincor.workflows.sweep.points import PARAMETER_AXIS

Axis = Sequence[Mapping[str, Any]]


def refuse_shared_fields(axes: Mapping[str, Axis], together: Sequence[Sequence[str]] = ()) -> None:
    """
    Refuse axes of which two set one field at one point.

    Parameters
    ----------
    axes : dict
        Names of the axes and what each of their values sets.
    together : sequence of sequence of str
        Axes that move together: equally long, and of their values only those at one place meet.

    Raises
    ------
    SweepError
        With the names of the two axes and of the field.
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


def fields_set(axes: Mapping[str, Axis]) -> list[str]:
    """Return every key that a value of an axis sets, each once, in their order."""
    return list(dict.fromkeys(key for axis in axes.values() for entry in axis for key in entry))


def _fields(axis: Axis) -> set[str]:
    """Return what an axis sets, the parameters of a formula one by one as well."""
    found: set[str] = set()
    for entry in axis:
        found |= entry.keys()
        if isinstance(inner := entry.get("parameters"), Mapping):
            found |= {f"{PARAMETER_AXIS}{name}" for name in inner}
    return found
