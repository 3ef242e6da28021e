"""What was measured: points by LAMMPS and in-house, with error bars, and whether they agree."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from chaincor.analysis.error_bar import error_alone
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.reference.hard_sphere import SCHEME
from chaincor.workflows.reproduce.plan import Plan, Study


class NoNumber(Exception):
    """The points that there are do not give a number; the message says why."""


@dataclass(frozen=True)
class Answer:
    """What one engine said of one scene."""

    result: dict[str, Any]  #: The fields of a collision's result; empty where there is none.
    arrays: dict[str, Array] = field(default_factory=dict, repr=False)  #: Its arrays, by name.
    failure: str | None = None  #: Why there is no result: name of the error and message.


def _number(value: float | None, missing: float = math.nan) -> float:
    return missing if value is None else float(value)


@dataclass(frozen=True)
class Point:
    """One scene, as planned for LAMMPS, with both engines' answers; None for one not asked."""

    scene: Scene
    lammps: Answer | None
    in_house: Answer | None

    @property
    def source(self) -> str | None:
        """
        Whose number is shown, ``lammps`` or ``in-house``; None where neither has one.

        LAMMPS's, unless it has none or misses the error asked (which its coordinates are not always
        exact enough for): then in-house's, if that meets it or has the smaller bar.
        """
        ours, other = ({} if a is None else a.result for a in (self.lammps, self.in_house))
        if not ours or not other:
            return "lammps" if ours else "in-house" if other else None
        if ours["tolerance_met"] is not False:
            return "lammps"
        bars = [_number(result["restitution_error"], math.inf) for result in (ours, other)]
        return "in-house" if other["tolerance_met"] or bars[1] < bars[0] else "lammps"

    @property
    def engine_name(self) -> str:
        """The source as people write it; a dash where there is none."""
        return {"lammps": "LAMMPS", "in-house": "in-house", None: "–"}[self.source]

    @property
    def origin(self) -> str:
        """Its length and its source, as texts have them."""
        return f"n = {self.particles}, {self.engine_name}"

    @property
    def answer(self) -> Answer:
        """The answer that is plotted and fitted; an empty one where there is none."""
        shown = {"lammps": self.lammps, "in-house": self.in_house, None: None}[self.source]
        return shown or Answer({})

    @property
    def answers(self) -> list[Answer]:
        """The answers that have a result, LAMMPS's first."""
        return [a for a in (self.lammps, self.in_house) if a is not None and a.result]

    @property
    def restitution(self) -> float:
        """The ratio of energies, eta; nan where there is no result."""
        return _number(self.answer.result.get("restitution"))

    @property
    def dissipation(self) -> float:
        """What is lost, 1 - eta."""
        return 1.0 - self.restitution

    @property
    def scaled_dissipation(self) -> float:
        """What is lost, times n^(2/3): constant where the law of long harmonic chains holds."""
        return self.dissipation * self.particles ** (2.0 / 3.0)

    @property
    def error(self) -> float:
        """Error bar of eta, as `bar_of` the answer shown."""
        return self.bar_of(self.answer)

    def bar_of(self, answer: Answer) -> float:
        """Return the error bar of an answer: its own, or what the two engines differ by if more."""
        # The bar first: a difference that is nan is not larger.
        return max(_number(answer.result.get("restitution_error")), abs(self.difference))

    @property
    def is_limit(self) -> bool:
        """Whether the value shown was put in, as that of hard spheres, and not integrated."""
        return self.answer.result.get("scheme") == SCHEME

    @property
    def is_open(self) -> bool:
        """Whether the error bar is mostly what a contact after the last one seen could change."""
        later = (self.answer.result.get("error_parts") or {}).get("ending")
        return (later or 0.0) > 0.5 * self.error

    @property
    def contacts(self) -> float:
        """How often particle 1 hit the wall."""
        return _number(self.answer.result.get("contacts"))

    @property
    def contacts_per_particle(self) -> float:
        """That number over n."""
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
        """The energy at impact, n v0^2/2."""
        return 0.5 * self.particles * self.scene.impact_velocity**2

    @property
    def difference(self) -> float:
        """LAMMPS less in-house; nan where one of them has no result."""
        both = [answer.result["restitution"] for answer in self.answers]
        return float(both[0] - both[1]) if len(both) == 2 else math.nan

    @property
    def summed_bars(self) -> float:
        """Sum of the two error bars; nan where one is missing."""
        bars = [_number(answer.result["restitution_error"]) for answer in self.answers]
        return sum(bars) if len(bars) == 2 else math.nan

    @property
    def allowed_difference(self) -> float:
        """Sum of the error that LAMMPS's runs tell by themselves and the in-house error bar."""
        if math.isnan(self.summed_bars):
            return math.nan
        results = [answer.result for answer in self.answers]
        return sum(error_alone(r.get("details", {}), r["restitution_error"]) for r in results)

    @property
    def agrees(self) -> bool | None:
        """Whether the two are within these; None where they cannot be compared."""
        allowed = self.allowed_difference
        return None if math.isnan(allowed) else abs(self.difference) <= allowed


def column(points: Iterable[Point], name: str) -> Array:
    """Return an attribute of each point."""
    return np.array([getattr(point, name) for point in points], dtype=float)


@dataclass(frozen=True)
class Measurements:
    """A plan, its studies, and all points by the key of their study."""

    plan: Plan
    studies: tuple[Study, ...]
    points: dict[str, tuple[Point, ...]]

    def select(
        self, study: str, potential: str, least: int = 0, missing: str = "no points", **wanted: Any
    ) -> list[Point]:
        """
        Return a study's points with a result and the fields wanted, by speed and length.

        Fewer than `least` are no number, for the reason `missing`.
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

    def all_points(self) -> Iterable[Point]:
        """Return each different point once, in the order of the studies."""
        unique = {point.scene: point for points in self.points.values() for point in points}
        return unique.values()
