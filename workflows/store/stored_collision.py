"""What a results store has on a collision, and whether that answers what is asked."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.tolerance import asked_tolerance
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
        The canonical scene.
    result : dict or None
        The fields of a :class:`~chaincor.workflows.result.Collision` but for the arrays; None where
        no try has succeeded.
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

    def answers(self, scene: Scene, *, arrays: bool = False) -> bool:
        """
        Say whether the result is exact enough for a scene.

        That is if the same or a smaller error was asked for, or reached; with explicit numerics, if
        there is an error bar or none is wanted.
        """
        if self.restitution is None or (arrays and not self.has_arrays):
            return False
        if scene.explicit:
            return self.restitution_error is not None or not scene.error
        asked = asked_tolerance(scene)
        assert asked is not None
        reached = self.restitution_error is not None and self.restitution_error <= asked
        return reached or (self.tolerance is not None and self.tolerance <= asked)

    def would_fail(self, scene: Scene) -> bool:
        """Say whether a scene failed by itself when no smaller an error was asked for."""
        if not self.failure_stands:
            return False
        asked = asked_tolerance(scene)
        return asked is None or self.failure_tolerance is None or asked <= self.failure_tolerance
