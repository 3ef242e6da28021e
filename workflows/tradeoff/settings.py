"""Define the settings of a study (engine, wall, scheme, table, step), and measure their errors."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import Engine, TableStyle, Wall
from chaincor.lammps_inputs.schemes import COMPOSITIONS, Scheme
from chaincor.workflows.accuracy.cost_model import cost_model
from chaincor.workflows.accuracy.step_guess import frequency_ratio
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.reference import stepping
from chaincor.workflows.errors import RunError
from chaincor.workflows.tradeoff.reference_solution import Deviation, ReferenceSolution

_ENGINES = {"lammps": lammps, "reference": stepping}
_ENGINE_NAMES = {"lammps": "LAMMPS", "reference": "reference"}
# For comparison with splines, linear tables have this force error, in units of v0. They need some
# thousands of rows, while splines with fewer rows are exact to within rounding.
_LINEAR_FORCE_ERROR = 1e-7
# Textbooks and mailing lists recommend fix wall/reflect, Verlet and this step.
STOCK_TIMESTEP = 0.005
STOCK_PHASES = 8
# Nearby steps differ by at most this fraction, and give different phases of the contacts within a
# step.
PHASE_WIDTH = 0.02
# A series of decreasing steps ends when its error is less than this many times the error that
# rounding and the reference run cause.
_FLOOR_SHARE = 3.0
# In the first pass, one run may take at most this fraction of the total time.
_LONGEST_SHARE = 0.08
# The plan assumes that a step of the reference engine costs this fraction of a step of LAMMPS.
_REFERENCE_COST = 0.1


@dataclass(frozen=True)
class Setting:
    """Numerics of one point in a work-precision study."""

    #: Engine, with its name in scenes.
    engine: Engine
    wall: Wall  #: Kind of the wall, with its name in scenes.
    scheme: Scheme  #: Integration scheme, with its name in scenes.
    table: TableStyle | None  #: Style of the table, ``linear`` or ``spline``; None without a table.
    timestep: float  #: Composed step H.

    @property
    def series(self) -> str:
        """Name of the series, which consists of all settings that differ only in the step."""
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
        Return the numerics for one run.

        `bond_range` is the range of the table; if it is None, the engine chooses the range.
        `phase`, from 0 to 1, shortens the step by up to 2 %.
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
    """Return the setting of the stock recipe at a step in units of :func:`time_unit`."""
    spline: TableStyle | None = None if scene.bond.is_harmonic else "spline"
    return Setting("lammps", "reflect", "verlet", spline, step * time_unit(scene, "reflect"))


def time_unit(scene: Scene, wall: Wall) -> float:
    """
    Return a unit of time in which steps of different scenes are comparable.

    The unit is 1/frequency of the most compressed bond. With the stock wall, it is 1/frequency of a
    bond at natural length, because the stock recipe ignores compression.
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
    """Return the settings of a study, one list for each series, from coarse to fine steps."""
    tabulated = not scene.bond.is_harmonic
    spline: TableStyle | None = "spline" if tabulated else None
    ratio = 2.0 if quick else 2.0**0.5
    ladders = [[stock_setting(scene, step) for step in _STOCK_STEPS[quick]]]
    unit = time_unit(scene, "event")
    for engine, left_out in _NOT_WHEN_QUICK.items():
        for scheme in COMPOSITIONS:
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
    """Errors and times of one setting, to which each run adds."""

    setting: Setting  #: Measured setting.
    #: Deviation from the reference at each phase.
    deviations: list[Deviation] = field(default_factory=list)
    #: Processor time of the integration alone, at each phase.
    seconds: list[float] = field(default_factory=list)
    #: Processor time for everything else: table, files, a new LAMMPS instance.
    setup_seconds: list[float] = field(default_factory=list)
    force_evaluations: int = 0  #: Number of force evaluations in one run.
    table_points: int | None = None  #: Number of rows in the table.
    failure: str | None = None  #: Reason for a failure.

    @property
    def errors(self) -> np.ndarray:
        """Absolute error of eta at each phase, of shape (phases,)."""
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
        """Largest error in the time of the last contact; inf if the number of contacts differs."""
        return max(each.last_contact_time for each in self.deviations)

    @property
    def mode_energy_error(self) -> float:
        """Largest error of a mode energy, as a fraction of the energy at impact."""
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
        # Processor time does not include the load from other programs.
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
    Run each series once from coarse to fine steps, then repeat all settings in turn.

    Return all measured settings, from coarse to fine steps within each series. If the settings
    would take more than `seconds` of processor time, the most expensive ones are not measured.
    Errors of eta below `floor` are hidden by rounding and by the error bar of the reference run, so
    finer steps are not run. `advance` is called with the elapsed fraction of the time.
    """
    for coarsest, *_ in ladders:
        # Compiled loops are loaded before times are measured.
        if coarsest.engine == "reference":
            Measurement(coarsest).run(reference, 0.0)
    started = time.thread_time()

    def spent() -> float:
        # The limit applies to processor time, so that no setting is dropped because other programs
        # run.
        return time.thread_time() - started

    def run(measurement: Measurement, phase: float) -> None:
        measurement.run(reference, phase)
        advance(min(1.0, spent() / seconds))

    # The first pass runs all series, starting with the cheapest step, in at most half the time.
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
    # Settings are repeated in turn, so that slow moments of the machine affect all settings alike.
    found = [m for series in measured for m in series]
    for turn in range(1, STOCK_PHASES):
        for measurement in found:
            # The error with the stock wall is irregular, so this wall needs more phases.
            stock = measurement.setting.wall == "reflect"
            wanted = STOCK_PHASES if stock else 2 if quick else 4
            if turn >= wanted or measurement.failure or not measurement.seconds:
                continue
            if spent() + measurement.time > seconds:
                continue
            run(measurement, turn / (wanted - 1))
    return found


def expected_seconds(reference: ReferenceSolution, setting: Setting) -> float:
    """Return the approximate time of one run with a setting, in seconds, for the plan."""
    numerics = setting.numerics(reference.scene)
    seconds = cost_model().integration(
        reference.scene.problem, numerics, reference.scouting.end.last_contact_time
    )
    if setting.engine == "reference":
        return _REFERENCE_COST * seconds
    return seconds if math.isfinite(seconds) else 0.0
