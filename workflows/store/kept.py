"""What a store keeps of a result: the columns of its row, and arrays."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.result import Collision, finite
from chaincor.workflows.store.schema import RESULT_COLUMNS


@dataclass(frozen=True)
class Kept:
    """
    A result as a store keeps it; a worker sends this back sooner than the result.

    Attributes
    ----------
    columns : dict
        Those that a result fills, see ``schema``.
    versions : str
        As JSON, for their own table.
    lengths : dict of str to int
        Of its arrays, by field name.
    numbers : bytes
        All of these arrays, one after the other.
    """

    columns: Mapping[str, Any]
    versions: str
    lengths: Mapping[str, int]
    numbers: bytes

    @classmethod
    def of(cls, collision: Collision) -> Self:
        """Return what is kept of a result."""
        fields = collision.plain()
        versions = _versions_json(tuple(fields.pop("versions").items()))
        columns = {name: finite(fields.pop(name)) for name in RESULT_COLUMNS}
        for name in _OF_SCENES:
            del fields[name]
        columns["details"] = _finite_json(fields)
        arrays = collision.arrays()
        lengths = {name: len(array) for name, array in arrays.items()}
        return cls(columns, versions, lengths, np.concatenate(list(arrays.values())).tobytes())

    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """Return the arrays by field name."""
        ends = np.cumsum(list(self.lengths.values()))
        parts = np.split(np.frombuffer(self.numbers), ends[:-1])
        return dict(zip(self.lengths, parts, strict=True))

    @property
    def tolerance_met(self) -> bool | None:
        """Whether the error bar is within the tolerance."""
        return self.columns["tolerance_met"]

    @property
    def seconds(self) -> float:
        """Wall-clock time of the integration."""
        return self.columns["seconds"]

    @property
    def seconds_total(self) -> float:
        """Wall-clock time of everything."""
        return self.columns["seconds_total"]


# The scene's columns hold them.
_OF_SCENES = ("potential", "particles", "engine", "scene_sha256")
# To make an encoder anew takes as long as to use it.
_write_json = json.JSONEncoder(sort_keys=True, allow_nan=False).encode


def _finite_json(fields: dict[str, Any]) -> str:
    try:
        return _write_json(fields)
    except ValueError:
        return _write_json(finite(fields))


@lru_cache(maxsize=16)
def _versions_json(items: tuple[tuple[str, str], ...]) -> str:
    return _write_json(dict(items))
