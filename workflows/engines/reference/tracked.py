"""Track quantities of a contact while the bodies overlap."""

from collections.abc import Callable
from typing import NamedTuple

from chaincor.lammps_inputs.arrays import Array

# The search for the largest overlap shortens its interval this many times; because of rounding,
# further steps would change nothing.
_TERNARY_STEPS = 52


class Overlapping(NamedTuple):
    """Gap and its derivatives at one end of a substep in which the bodies overlap."""

    gap: float  #: Gap; negative for bodies that overlap.
    rate: float  #: First derivative in time.
    acceleration: float  #: Second derivative in time.


def gap_within(before: Overlapping, after: Overlapping, time: float, part: float) -> float:
    """Return the gap within a substep, from the quintic between its ends."""
    g, v, a = before.gap, before.rate * time, 0.5 * before.acceleration * time * time
    gap_rest = after.gap - g - v - a
    velocity_rest = after.rate * time - v - 2.0 * a
    acceleration_rest = 0.5 * after.acceleration * time * time - a
    third = 10.0 * gap_rest - 4.0 * velocity_rest + acceleration_rest
    fourth = -15.0 * gap_rest + 7.0 * velocity_rest - 2.0 * acceleration_rest
    fifth = 6.0 * gap_rest - 3.0 * velocity_rest + acceleration_rest
    return g + part * (v + part * (a + part * (third + part * (fourth + part * fifth))))


def build_largest_overlap(register: Callable) -> Callable:
    """Return the function that updates the largest overlap after a substep."""
    gap_at = register(gap_within)

    @register
    def largest_overlap(
        value: float, before: Overlapping, after: Overlapping, time: float
    ) -> float:
        lowest = min(before.gap, after.gap)
        if before.rate < 0.0 < after.rate:
            low, high = 0.0, 1.0
            for _ in range(_TERNARY_STEPS):
                # The gap is convex near its minimum: keep the two thirds in which the gap is lower.
                first, last = low + (high - low) / 3.0, high - (high - low) / 3.0
                if gap_at(before, after, time, first) < gap_at(before, after, time, last):
                    high = last
                else:
                    low = first
            lowest = min(lowest, gap_at(before, after, time, 0.5 * (low + high)))
        return max(value, -lowest)

    return largest_overlap


#: Builders of the update functions, by the names of the quantities. Each quantity has the initial
#: value 0. An update ``f(value, before, after, time)`` returns the new value after a substep.
TRACKED: dict[str, Callable] = {"largest_overlap": build_largest_overlap}


def build_track(register: Callable) -> Callable:
    """Return ``track(values, before, after, time)``, which updates all quantities in place."""

    @register
    def track(values: Array, before: Overlapping, after: Overlapping, time: float) -> None:
        pass

    for place, build in enumerate(TRACKED.values()):
        track = _also(track, build(register), place, register)
    return track


def _also(others: Callable, update: Callable, place: int, register: Callable) -> Callable:
    @register
    def track(values: Array, before: Overlapping, after: Overlapping, time: float) -> None:
        others(values, before, after, time)
        values[place] = update(values[place], before, after, time)

    return track


def tracked_values(values: Array, soft: bool) -> dict[str, float]:
    """Return the tracked values by name; empty for hard bodies, which never overlap."""
    return dict(zip(TRACKED, values.tolist(), strict=True)) if soft else {}
