"""Points: each by LAMMPS and in-house, with error bars, and whether the two agree."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.scene import DEFAULT_HARMONIC_VELOCITY, Scene
from chaincor.workflows.engines.in_house.hard_sphere import SCHEME
from chaincor.workflows.error_bar import error_alone
from chaincor.workflows.reproduce.plan import Plan


@dataclass(frozen=True)
class Answer:
    """What one engine said of one scene."""

    result: dict[str, Any]  #: The fields of a collision's result; empty where there is none.
    arrays: dict[str, Array] = field(default_factory=dict, repr=False)  #: Its arrays, by name.
    failure: str | None = None  #: Why there is no result: name of the error and message.


# The sum of two error bars up to which a comparison tells much, in units of the error asked.
_SHARP = 10.0


class NoNumber(Exception):
    """The points that there are do not give a number; the message says why."""


@dataclass(frozen=True)
class Study:
    """Scenes that belong together."""

    key: str  #: Name, such as ``curves``.
    title: str  #: For the progress bar and the table of times.
    scenes: tuple[Scene, ...]  #: Run by LAMMPS and in-house.
    in_house: tuple[Scene, ...] = ()  #: Run in-house only: too long for LAMMPS in this plan.
    #: Harmonic chains of 20 particles or more, by the echo of their free end.
    echoed: tuple[Scene, ...] = ()

    @property
    def all_scenes(self) -> tuple[Scene, ...]:
        """All of them, however run."""
        return (*self.scenes, *self.in_house, *self.echoed)


def harmonic_scene(
    particles: int, tolerance: float, velocity: float = DEFAULT_HARMONIC_VELOCITY
) -> Scene:
    """Return a harmonic chain's scene, the same for all studies: what is equal is run once."""
    return Scene(potential="harmonic", particles=particles, velocity=velocity, tolerance=tolerance)


def _bar(result: dict[str, Any]) -> float:
    bar = result["restitution_error"]
    return float("inf") if bar is None else float(bar)


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
        better = other["tolerance_met"] or _bar(other) < _bar(ours)
        return "in-house" if better else "lammps"

    @property
    def engine_name(self) -> str:
        """The source as people write it; a dash where there is none."""
        return {"lammps": "LAMMPS", "in-house": "in-house", None: "–"}[self.source]

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
    def results(self) -> list[dict[str, Any]]:
        """Their results."""
        return [answer.result for answer in self.answers]

    def _number(self, name: str) -> float:
        value = self.answer.result.get(name)
        return float("nan") if value is None else float(value)

    @property
    def restitution(self) -> float:
        """The ratio of energies, eta; nan where there is no result."""
        return self._number("restitution")

    @property
    def dissipation(self) -> float:
        """What is lost, 1 - eta."""
        return 1.0 - self.restitution

    @property
    def error(self) -> float:
        """Error bar of eta, as `bar_of` the answer shown."""
        return self.bar_of(self.answer)

    def bar_of(self, answer: Answer) -> float:
        """Return the error bar of an answer: its own, or what the two engines differ by if more."""
        bar = answer.result.get("restitution_error")
        return float("nan") if bar is None else max(float(bar), abs(self.difference or 0.0))

    @property
    def is_limit(self) -> bool:
        """Whether the value shown was put in, as that of hard spheres, and not integrated."""
        return self.answer.result.get("scheme") == SCHEME

    @property
    def later_contact(self) -> float:
        """By how much a contact after the last one seen could change eta; 0 if none can come."""
        return float((self.answer.result.get("error_parts") or {}).get("ending") or 0.0)

    @property
    def is_open(self) -> bool:
        """Whether the error bar is mostly what a later contact could change."""
        return self.later_contact > 0.5 * self.error

    @property
    def contacts(self) -> float:
        """How often particle 1 hit the wall."""
        return self._number("contacts")

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
        scale = self.scene.bond.natural_speed
        if self.scene.speed is not None:
            return self.scene.speed
        return float("nan") if scale is None else self.scene.impact_velocity / scale

    @property
    def difference(self) -> float | None:
        """LAMMPS less in-house; None where one of them has no result."""
        results = self.results
        if len(results) < 2:
            return None
        return float(results[0]["restitution"] - results[1]["restitution"])

    @property
    def summed_bars(self) -> float | None:
        """Sum of the two error bars; None where one is missing."""
        bars = [result["restitution_error"] for result in self.results]
        return None if len(bars) < 2 or None in bars else float(sum(bars))

    @property
    def allowed_difference(self) -> float | None:
        """Sum of the error that LAMMPS's runs tell by themselves and the in-house error bar."""
        if self.summed_bars is None:
            return None
        return sum(
            error_alone(result.get("details", {}), result["restitution_error"])
            for result in self.results
        )

    @property
    def agrees(self) -> bool | None:
        """Whether the two are within these; None where they cannot be compared."""
        difference, allowed = self.difference, self.allowed_difference
        return None if difference is None or allowed is None else abs(difference) <= allowed


@dataclass(frozen=True)
class Measurements:
    """A plan, its studies, and all points by the key of their study."""

    plan: Plan
    studies: tuple[Study, ...]
    points: dict[str, tuple[Point, ...]]

    @property
    def sharp(self) -> float:
        """Sum of two error bars up to which a comparison of the engines tells much."""
        return _SHARP * self.plan.tolerance

    def select(
        self,
        study: str,
        potential: str,
        least: int = 0,
        missing: str = "no points",
        **wanted: Any,
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

    def seconds(self, study: str) -> dict[str, float]:
        """Return the seconds of computing that a study took, for ``lammps`` and ``in_house``."""
        return {
            engine: sum(
                answer.result["seconds_total"]
                for answer in (getattr(point, engine) for point in self.points[study])
                if answer is not None and answer.result
            )
            for engine in ("lammps", "in_house")
        }

    def all_points(self) -> Iterable[Point]:
        """Return each different point once, in the order of the studies."""
        unique = {point.scene: point for points in self.points.values() for point in points}
        return unique.values()
