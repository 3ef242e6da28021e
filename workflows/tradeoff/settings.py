"""Define the settings of a study (engine, wall, scheme, table, step), and measure them."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import Engine, TableStyle, Wall
from chaincor.lammps_inputs.schemes import SCHEME_ORDERS, Scheme
from chaincor.workflows.accuracy.cost_model import cost_model
from chaincor.workflows.accuracy.step_guess import frequency_ratio
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.reference import stepping
from chaincor.workflows.errors import RunError
from chaincor.workflows.tradeoff.reference_solution import Deviation, ReferenceSolution

_ENGINES = {"lammps": lammps, "reference": stepping}
_ENGINE_NAMES = {"lammps": "LAMMPS", "reference": "reference"}
# Linear tables that are compared with splines have this force error, in units of v0. They need some
# thousands of rows, while splines are exact to rounding with fewer rows.
_LINEAR_FORCE_ERROR = 1e-7
# Textbooks and mailing lists recommend fix wall/reflect, Verlet and this step.
STOCK_TIMESTEP = 0.005
STOCK_PHASES = 8
# Steps within this fraction of a setting give different phases of the contacts within a step.
PHASE_WIDTH = 0.02
# A ladder ends when the error is at most this many times the floor.
_FLOOR_SHARE = 3.0
# One run of the first pass may take at most this fraction of the time.
_LONGEST_SHARE = 0.08
# The plan assumes that a step of the reference engine costs this fraction of a step of LAMMPS.
_REFERENCE_COST = 0.1


@dataclass(frozen=True)
class Setting:
    """Setting of one point in a work-precision study."""

    #: As in scenes.
    engine: Engine
    wall: Wall  #: As in scenes.
    scheme: Scheme  #: As in scenes.
    table: TableStyle | None  #: ``linear`` or ``spline``; None without a table.
    timestep: float  #: Composed step H.

    @property
    def series(self) -> str:
        """Name of the series, which contains all settings that differ only in the step."""
        parts = [_ENGINE_NAMES[self.engine]]
        if self.engine == "lammps":
            parts.append("stock wall" if self.wall == "reflect" else "event wall")
        parts.append(self.scheme)
        if self.table == "linear":
            parts.append("linear table")
        return ", ".join(parts)

    def numerics(
        self, scene: Scene, bond_range: tuple[float, float] | None = None, phase: float = 0.0
    ) -> Numerics:
        """
        Return the numerics of one run.

        `bond_range` is the range of the table, or None if the engine chooses it. `phase`, from 0 to
        1, shortens the step by up to 2 %.
        """
        linear = self.table == "linear"
        return Numerics(
            wall=self.wall,
            scheme=self.scheme,
            timestep=self.timestep * (1.0 - PHASE_WIDTH * phase),
            table=self.table or "spline",
            bond_range=bond_range,
            force_error=_LINEAR_FORCE_ERROR * scene.impact_velocity if linear else None,
        )


def stock_setting(scene: Scene, step: float = STOCK_TIMESTEP) -> Setting:
    """Return the setting of the stock recipe at a step, which is in its unit of time."""
    spline: TableStyle | None = None if scene.bond.is_harmonic else "spline"
    return Setting("lammps", "reflect", "verlet", spline, step * time_unit(scene, "reflect"))


def time_unit(scene: Scene, wall: Wall) -> float:
    """
    Return the unit of time that makes steps of different scenes comparable.

    The unit is 1/frequency of the most compressed bond. For the stock wall, whose recipe ignores
    compression, it is 1/frequency of a bond at natural length.
    """
    unit = scene.bond.stiffness**-0.5
    return unit if wall == "reflect" else unit / frequency_ratio(scene.problem)


_STOCK_STEPS = {
    False: (0.05, 0.02, 0.01, STOCK_TIMESTEP, 0.002, 0.001),
    True: (0.02, STOCK_TIMESTEP),
}
_EVENT_ENDS: dict[Scheme, tuple[float, float]] = {
    "verlet": (0.2, 0.003),
    "order4": (0.8, 0.05),
    "order6": (0.8, 0.07),
    "order8": (0.8, 0.1),
}
_OTHER_ENDS = (0.8, 0.05)  # for schemes without an entry
_NOT_WHEN_QUICK: dict[Engine, tuple[Scheme, ...]] = {
    "lammps": ("order4",),
    "reference": ("verlet", "order4"),
}


def study_settings(scene: Scene, quick: bool) -> list[list[Setting]]:
    """Return the ladders of a study, one per series, each from coarse to fine."""
    tabulated = not scene.bond.is_harmonic
    spline: TableStyle | None = "spline" if tabulated else None
    ratio = 2.0 if quick else 2.0**0.5
    ladders = [[stock_setting(scene, step) for step in _STOCK_STEPS[quick]]]
    unit = time_unit(scene, "event")
    for engine, left_out in _NOT_WHEN_QUICK.items():
        for scheme in SCHEME_ORDERS:
            first, last = _EVENT_ENDS.get(scheme, _OTHER_ENDS)
            if quick and scheme in left_out:
                continue
            styles: tuple[TableStyle | None, ...] = (spline if engine == "lammps" else None,)
            if tabulated and engine == "lammps" and scheme in ("verlet", "order6") and not quick:
                styles = ("spline", "linear")
            steps = [first]
            while steps[-1] / ratio > 0.99 * last:
                steps.append(steps[-1] / ratio)
            ladders += [
                [Setting(engine, "event", scheme, style, unit * step) for step in steps]
                for style in styles
            ]
    return ladders


@dataclass
class Measurement:
    """Errors and times of one setting, collected run by run."""

    setting: Setting  #: Measured setting.
    deviations: list[Deviation] = field(default_factory=list)  #: Error at each phase.
    #: Processor time of the integration alone, one for each phase.
    seconds: list[float] = field(default_factory=list)
    #: Processor time of the rest: table, files, a new LAMMPS.
    setup_seconds: list[float] = field(default_factory=list)
    force_evaluations: int = 0  #: Number in one run.
    table_points: int | None = None  #: Rows of the table.
    failure: str | None = None  #: Reason of a failure.

    @property
    def errors(self) -> np.ndarray:
        """Absolute error of eta at each phase, shape (phases,)."""
        return np.array([abs(each.restitution) for each in self.deviations])

    @property
    def median_error(self) -> float:
        """Median absolute error of eta over the phases."""
        return float(np.median(self.errors))

    @property
    def rms_error(self) -> float:
        """Root-mean-square error of eta over the phases."""
        return float(np.sqrt(np.mean(self.errors**2)))

    @property
    def worst_error(self) -> float:
        """Largest absolute error of eta over the phases."""
        return float(np.max(self.errors))

    @property
    def contact_time_error(self) -> float:
        """Largest error of the last contact's time; inf if the number of contacts differs."""
        return max(each.last_contact_time for each in self.deviations)

    @property
    def mode_energy_error(self) -> float:
        """Largest error of a mode energy, in units of the energy at impact."""
        return max(each.mode_energies for each in self.deviations)

    @property
    def time(self) -> float:
        """Median processor time of the integration, in seconds."""
        return float(np.median(self.seconds))

    def run(self, reference: ReferenceSolution, phase: float) -> None:
        """Run the setting at a `phase` from 0 to 1, as in :meth:`Setting.numerics`."""
        numerics = self.setting.numerics(reference.scene, reference.bond_range, phase)
        started, worked = time.perf_counter(), time.thread_time()
        try:
            outcome = _ENGINES[self.setting.engine].run(reference.scene.problem, numerics)
        except RunError as error:
            self.failure = str(error)
            return
        total, busy = time.perf_counter() - started, time.thread_time() - worked
        # Processor time does not count the load of other programs.
        integration = outcome.seconds * min(busy / total, 1.0)
        self.deviations.append(reference.deviation(outcome))
        self.seconds.append(integration)
        self.setup_seconds.append(max(busy - integration, 0.0))
        self.force_evaluations = outcome.force_evaluations
        self.table_points = outcome.details.get("table", {}).get("rows")


def measure_ladders(
    reference: ReferenceSolution,
    ladders: list[list[Setting]],
    *,
    quick: bool,
    seconds: float,
    floor: float,
    advance: Callable[[float], None],
) -> list[Measurement]:
    """
    Run each ladder once from coarse to fine, then repeat all settings in turn.

    Returns all measured settings, from coarse to fine within each series. If they do not fit into
    `seconds` of processor time, the most expensive settings are left out. `floor` is the error of
    eta that rounding and the error bar of the reference run hide, so that finer steps show nothing.
    `advance` is called with the fraction of the time that has passed.
    """
    for coarsest, *_ in ladders:
        # Compiled loops are loaded before the clock starts.
        if coarsest.engine == "reference":
            Measurement(coarsest).run(reference, 0.0)
    started = time.thread_time()

    def spent() -> float:
        # The limit is processor time, so that the load of other programs leaves no settings out.
        return time.thread_time() - started

    def run(measurement: Measurement, phase: float) -> None:
        measurement.run(reference, phase)
        advance(min(1.0, spent() / seconds))

    # The first pass runs all ladders, with the cheapest step first, in at most half the time.
    measured: list[list[Measurement]] = [[] for _ in ladders]
    rungs = [(k, setting) for k, ladder in enumerate(ladders) for setting in ladder]
    rungs.sort(key=lambda rung: expected_seconds(reference, rung[1]))
    longest = _LONGEST_SHARE * seconds
    for k, setting in rungs:
        before = [m for m in measured[k] if m.failure is None]
        if before and before[-1].median_error < _FLOOR_SHARE * floor:
            continue
        expected = expected_seconds(reference, setting)
        if before and (expected > longest or spent() + expected > 0.6 * seconds):
            continue
        measurement = Measurement(setting)
        run(measurement, 0.0)
        measured[k].append(measurement)
    # Settings are repeated in turn, so that a slow moment of the machine affects all of them alike.
    found = [m for series in measured for m in series]
    for turn in range(1, STOCK_PHASES):
        for measurement in found:
            # The error of the stock wall is irregular, so it needs more phases.
            stock = measurement.setting.wall == "reflect"
            wanted = STOCK_PHASES if stock else 2 if quick else 4
            if turn >= wanted or measurement.failure or not measurement.seconds:
                continue
            if spent() + measurement.time > seconds:
                continue
            run(measurement, turn / (wanted - 1))
    return found


def expected_seconds(reference: ReferenceSolution, setting: Setting) -> float:
    """Return the approximate time of one run of a setting in seconds, for the plan."""
    numerics = setting.numerics(reference.scene)
    seconds = cost_model().integration(
        reference.scene.problem, numerics, reference.scouting.end.last_contact_time
    )
    if setting.engine == "reference":
        return _REFERENCE_COST * seconds
    return seconds if math.isfinite(seconds) else 0.0
