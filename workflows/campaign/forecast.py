"""Forecast how much time and disk space many collisions take."""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from chaincor.workflows.campaign.carry_out import CollisionRequest
from chaincor.workflows.campaign.cells import WINDOW, Cells
from chaincor.workflows.campaign.tasks import requests_of, tightest, with_batches
from chaincor.workflows.versions import cores_allowed

# Seconds from the start of the command to the first collision, for imports, processes and compiled
# code.
_START_SECONDS = 2.5
# Sizes in bytes: a row and its key in the index, with and without details, and the header of an
# array in NumPy's format.
_ROW_BYTES = {True: 2200, False: 400}
_ARRAY_BYTES = 5 * 230
# The forecast for a large sweep is computed from a sample of this many collisions.
_SAMPLE = 2000


@dataclass(frozen=True)
class Forecast:
    """
    Expected time and disk space of collisions, on an idle machine.

    For nearly every collision, the time is right within a factor of two, and for chains that break
    within a factor of four. Sums over many collisions are more accurate.
    """

    points: int  #: Number of collisions to compute.
    #: Sum of the collisions' times on one core.
    seconds: float
    longest: float  #: Time of the longest collision.
    disk_bytes: int  #: Growth of the store, in bytes.
    #: Number of collisions in the sample behind the forecast; None if all collisions were counted.
    sample: int | None = None

    @classmethod
    def of(
        cls,
        asked: Sequence[CollisionRequest],
        *,
        arrays: bool = False,
        details: bool = True,
        weight: float | None = None,
    ) -> "Forecast":
        """
        Return the forecast for collisions, with or without their arrays and details.

        If the collisions are a sample, each of them stands for `weight` collisions.
        """
        each_stands_for = 1.0 if weight is None else weight
        costs = [each.cost for each in with_batches(asked, each_stands_for)]
        # Two arrays have one number per contact, and three arrays have one number per particle.
        # There are hardly more contacts than particles.
        sizes = [_ARRAY_BYTES + 5 * 8 * each.particles for each in asked if arrays]
        room = _ROW_BYTES[details] * len(asked) + sum(sizes)
        return cls(
            round(each_stands_for * len(asked)),
            each_stands_for * sum(costs),
            max(costs, default=0.0),
            round(each_stands_for * room),
            None if weight is None else len(asked),
        )

    def wall_seconds(self, workers: int) -> float:
        """Return the wall-clock time if several workers share the available cores."""
        if self.points == 0:
            return 0.0
        together = min(workers, cores_allowed())
        return _START_SECONDS + max(self.seconds / together, self.longest)


def forecast_cells(
    cells: Cells,
    missing: Callable[[Sequence[CollisionRequest]], list[CollisionRequest]] = tightest,
    *,
    arrays: bool = False,
    details: bool = True,
) -> Forecast:
    """
    Return the forecast for those collisions of a sweep that are `missing` in a store.

    The forecast for a large sweep is computed from a sample that represents all chain lengths.
    """
    if len(cells) <= WINDOW:
        points = [cells.points.point(k) for k in cells.numbers(0, WINDOW)]
        return Forecast.of(missing(requests_of(points)), arrays=arrays, details=details)
    chance, step = random.Random(0), len(cells) / _SAMPLE
    places = [min(int((k + chance.random()) * step), len(cells) - 1) for k in range(_SAMPLE)]
    points = [cells.points.point(number) for place in places for number in cells[place]]
    return Forecast.of(missing(requests_of(points)), arrays=arrays, details=details, weight=step)
