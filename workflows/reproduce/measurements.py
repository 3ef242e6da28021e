"""Represent measured points, with the results and error bars of both engines."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from chaincor.analysis.error_bar import error_alone
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.reference.hard_sphere import SCHEME
from chaincor.workflows.reproduce.plan import ReproductionPlan, Study


class NoNumber(Exception):
    """The points do not determine a number; the message says why."""


@dataclass(frozen=True)
class Answer:
    """Result of one engine for one scene."""

    result: dict[str, Any]  #: Fields of the result; empty without a result.
    #: Arrays of the result, by name.
    arrays: dict[str, Array] = field(default_factory=dict, repr=False)
    failure: str | None = None  #: Name and message of the error, if there is no result.


def _number(value: float | None, missing: float = math.nan) -> float:
    return missing if value is None else float(value)


@dataclass(frozen=True)
class MeasuredPoint:
    """Scene as planned for LAMMPS, with the result of each engine that was used."""

    scene: Scene
    lammps: Answer | None
    reference: Answer | None

    @property
    def source(self) -> str | None:
        """
        Engine whose result is shown, ``lammps`` or ``reference``; None without a result.

        LAMMPS's result is shown if it meets the target error. Otherwise the reference engine's
        result is shown, if it meets the target error or has the smaller error bar. LAMMPS can miss
        the target error, because the rounding of its absolute coordinates limits the accuracy.
        """
        ours, other = ({} if a is None else a.result for a in (self.lammps, self.reference))
        if not ours or not other:
            return "lammps" if ours else "reference" if other else None
        if ours["tolerance_met"] is not False:
            return "lammps"
        bars = [_number(result["restitution_error"], math.inf) for result in (ours, other)]
        return "reference" if other["tolerance_met"] or bars[1] < bars[0] else "lammps"

    @property
    def engine_name(self) -> str:
        """Name of the engine in texts; a dash without a result."""
        return {"lammps": "LAMMPS", "reference": "reference", None: "–"}[self.source]

    @property
    def origin(self) -> str:
        """Chain length and engine, as written in texts."""
        return f"n = {self.particles}, {self.engine_name}"

    @property
    def answer(self) -> Answer:
        """Result that is plotted and fitted; an empty result if there is none."""
        shown = {"lammps": self.lammps, "reference": self.reference, None: None}[self.source]
        return shown or Answer({})

    @property
    def answers(self) -> list[Answer]:
        """Results of those engines that have one, with LAMMPS first."""
        return [a for a in (self.lammps, self.reference) if a is not None and a.result]

    @property
    def restitution(self) -> float:
        """Ratio of energies, eta; nan without a result."""
        return _number(self.answer.result.get("restitution"))

    @property
    def dissipation(self) -> float:
        """Dissipation 1 - eta."""
        return 1.0 - self.restitution

    @property
    def scaled_dissipation(self) -> float:
        """Dissipation times n^(2/3), which the law of long harmonic chains makes constant."""
        return self.dissipation * self.particles ** (2.0 / 3.0)

    @property
    def error(self) -> float:
        """Error bar of eta in the shown result."""
        return self.bar_of(self.answer)

    def bar_of(self, answer: Answer) -> float:
        """Return the error bar of a result, or the engines' difference if that is larger."""
        # The error bar is the first argument, because max() returns its first argument if the
        # second is nan.
        return max(_number(answer.result.get("restitution_error")), abs(self.difference))

    @property
    def is_limit(self) -> bool:
        """Whether the shown value is the limit of hard spheres instead of an integrated result."""
        return self.answer.result.get("scheme") == SCHEME

    @property
    def is_open(self) -> bool:
        """Whether the error bar mostly covers the effect of a possible later contact."""
        later = (self.answer.result.get("error_parts") or {}).get("ending")
        return (later or 0.0) > 0.5 * self.error

    @property
    def contacts(self) -> float:
        """Number of contacts between particle 1 and the wall."""
        return _number(self.answer.result.get("contacts"))

    @property
    def contacts_per_particle(self) -> float:
        """Number of contacts divided by n."""
        return self.contacts / self.particles

    @property
    def particles(self) -> int:
        """Chain length n."""
        return self.scene.particles

    @property
    def speed(self) -> float:
        """Impact speed in units of v*; nan for a harmonic chain."""
        if self.scene.speed is not None:
            return self.scene.speed
        return self.scene.impact_velocity / _number(self.scene.bond.natural_speed)

    @property
    def energy(self) -> float:
        """Energy at impact, n v0^2/2."""
        return 0.5 * self.particles * self.scene.impact_velocity**2

    @property
    def difference(self) -> float:
        """LAMMPS's eta minus the reference engine's eta; nan if a result is missing."""
        both = [answer.result["restitution"] for answer in self.answers]
        return float(both[0] - both[1]) if len(both) == 2 else math.nan

    @property
    def summed_bars(self) -> float:
        """Sum of both engines' error bars; nan if one is missing."""
        bars = [_number(answer.result["restitution_error"]) for answer in self.answers]
        return sum(bars) if len(bars) == 2 else math.nan

    @property
    def allowed_difference(self) -> float:
        """
        Sum of both engines' errors.

        LAMMPS's error is estimated from LAMMPS runs alone.
        """
        if math.isnan(self.summed_bars):
            return math.nan
        results = [answer.result for answer in self.answers]
        return sum(error_alone(r.get("details", {}), r["restitution_error"]) for r in results)

    @property
    def agrees(self) -> bool | None:
        """Whether the engines agree within `allowed_difference`; None without a comparison."""
        allowed = self.allowed_difference
        return None if math.isnan(allowed) else abs(self.difference) <= allowed


def column(points: Iterable[MeasuredPoint], name: str) -> Array:
    """Return an array with an attribute of all points."""
    return np.array([getattr(point, name) for point in points], dtype=float)


@dataclass(frozen=True)
class Measurements:
    """Plan, and all points by the name of their study."""

    plan: ReproductionPlan
    studies: tuple[Study, ...]
    points: dict[str, tuple[MeasuredPoint, ...]]

    def select(
        self, study: str, potential: str, least: int = 0, missing: str = "no points", **wanted: Any
    ) -> list[MeasuredPoint]:
        """
        Return points of a study with a result and given fields, sorted by speed and length.

        Raise NoNumber with the message `missing` if there are fewer than `least` points.
        """
        chosen = [
            point
            for point in self.points[study]
            if point.scene.label == potential
            and all(getattr(point.scene, name) == value for name, value in wanted.items())
            and point.source is not None
        ]
        if len(chosen) < least:
            raise NoNumber(missing)
        return sorted(chosen, key=lambda point: (point.scene.impact_velocity, point.particles))

    def all_points(self) -> Iterable[MeasuredPoint]:
        """Return all points in the order of the studies, each once."""
        unique = {point.scene: point for points in self.points.values() for point in points}
        return unique.values()
