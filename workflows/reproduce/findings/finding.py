"""One number found, with its error and the points it rests on."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from chaincor.workflows.reproduce.measurements import Point


@dataclass(frozen=True)
class Finding:
    """
    One number that a claim of the paper is judged by.

    Attributes
    ----------
    value : float
        The number; nan where the points do not give one.
    error : float
        Its error: from error bars, from the scatter of a fit, or the spacing of points.
    text : str
        How it was found: range, points, what it depends on.
    points : sequence of Point
        What it rests on: if LAMMPS and the in-house engine disagree on one of them, no verdict can
        be better than "not reproduced".
    spread : tuple of float or None
        Least and largest value over other ranges, or of what it is a mean of; it widens no margin.
    brief : str
        What the summary says of it, where the number alone would say too little.
    """

    value: float
    error: float
    text: str
    points: Sequence[Point] = field(default=(), repr=False)
    spread: tuple[float, float] | None = None
    brief: str = ""

    @property
    def disagreements(self) -> int:
        """Points on which the two engines differ by more than their bars."""
        return sum(point.agrees is False for point in self.points)

    @property
    def unchecked(self) -> int:
        """Points that only one of the engines has, so that nothing checks them."""
        return sum(point.agrees is None for point in self.points)
