"""What a store has on a collision: whether it answers a scene, and which of two results stays."""

import math
from dataclasses import dataclass
from typing import Any

from chaincor.lammps_inputs.scene import Scene


@dataclass(frozen=True)
class Standing:
    """What a store has on a collision, as far as it decides whether to run it and what stays."""

    #: Of the result.
    restitution: float | None
    restitution_error: float | None  #: See ``restitution``.
    #: The tightest that has been asked of the collision and that the result stands for: it meets
    #: it, or no run has come closer. None with explicit numerics.
    tolerance: float | None
    failure_tolerance: float | None  #: Asked for when it failed.
    failure_stands: bool  #: Whether there is a failure that would come again.
    tries: int  #: How often it was carried out.
    finished: str  #: When: UTC, ISO 8601.
    has_arrays: bool  #: Whether the arrays are kept.

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
        if self.restitution is None or (arrays and not self.has_arrays):
            return False
        asked = scene.asked_tolerance
        if asked is None:
            return True
        return self.reached <= asked or (self.tolerance is not None and self.tolerance <= asked)

    def would_fail(self, scene: Scene) -> bool:
        """Say whether a scene failed by itself when no smaller an error was asked for."""
        if not self.failure_stands:
            return False
        asked = scene.asked_tolerance
        return asked is None or self.failure_tolerance is None or asked <= self.failure_tolerance

    def yields_to(self, other: "Standing", *, renew: bool = False) -> bool:
        """
        Say whether something else on the same collision takes the place of this: the one rule.

        A result takes the place of a failure, a later failure that of an earlier one. Of two
        results the one with the smaller error bar stays, none counting as the largest; of equal
        ones that with arrays; else the one that is there.

        Parameters
        ----------
        other : Standing
            What comes.
        renew : bool
            Whether it was computed to take the place of this, on request or for the arrays that
            this lacks. Then it does so if it was asked for no less exactly, whatever it reached;
            but without an error bar it never takes the place of a result with one.
        """
        if other.restitution is None:
            return self.restitution is None and other.finished > self.finished
        if self.restitution is None:
            return True
        loses_bar = math.isfinite(self.reached) and not math.isfinite(other.reached)
        if renew and not loses_bar and not self._asked_more_exactly_than(other):
            return True
        return (other.reached, not other.has_arrays) < (self.reached, not self.has_arrays)

    def _asked_more_exactly_than(self, other: "Standing") -> bool:
        if self.tolerance is None or other.tolerance is None:
            return False  # explicit numerics: every run is the same
        return self.tolerance < other.tolerance

    def tightened_by(self, other: "Standing") -> dict[str, Any]:
        """
        Return what changes in a row that stays if the other was asked for more exactly.

        From then on the row stands for that tolerance, too, whether it meets it or no run came
        closer: else a sweep that asks for it would run it again and again. As columns and their
        values; empty if nothing changes.
        """
        if self.restitution is None or other.restitution is None:
            return {}
        if other.tolerance is None or not other._asked_more_exactly_than(self):
            return {}
        met = self.reached <= other.tolerance
        missed = (
            f"the error reached is {self.reached:.2g}, not {other.tolerance:g}; a run that was "
            "asked for that reached no smaller one"
        )
        return {
            "tolerance": other.tolerance,
            "tolerance_met": met,
            "reason": None if met else missed,
        }


def standing_columns(database: str = "main") -> str:
    """Return the SQL expressions of the fields of a Standing, over a database's `collisions`."""
    row = f"{database}.collisions"
    return (
        f"{row}.restitution, {row}.restitution_error, {row}.tolerance, {row}.failure_tolerance, "
        f"coalesce({row}.failure_stands, 0), {row}.tries, {row}.finished, "
        f"EXISTS (SELECT 1 FROM {database}.arrays AS kept "
        f"WHERE kept.collision_sha256 = {row}.collision_sha256)"
    )
