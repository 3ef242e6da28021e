"""One row of a results store."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.store.attempt import Failure


@dataclass(frozen=True)
class StoredCollision:
    """
    One row of a results store.

    Attributes
    ----------
    collision_sha256 : str
        Key of the row: hash of the scene without its tolerance.
    scene : dict
        The canonical scene, with the tolerance of the run that gave the result.
    result : dict or None
        The fields of a :class:`~chaincor.workflows.result.Collision` but for the arrays; None where
        no try has succeeded. ``tolerance`` is the tightest that was asked of the collision and that
        the result stands for, ``tolerance_met`` and ``reason`` are by that.
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
        and ``displacements``, the last three also of a free target (``target_...``); empty where
        they were not kept or not asked for.
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
