"""Settings of a study (engine, wall, scheme, table, step), their runs and their errors."""

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
from chaincor.workflows.tradeoff.truth import Deviation, Truth

_ENGINES = {"lammps": lammps, "reference": stepping}
_ENGINE_NAMES = {"lammps": "LAMMPS", "reference": "reference"}
# Force error of the linear tables that are compared with splines, in units of v0. It takes some
# thousands of rows. Splines need fewer rows to be exact to rounding.
_LINEAR_FORCE_ERROR = 1e-7
# Recipe of textbooks and mailing lists: fix wall/reflect, Verlet, this step.
STOCK_TIMESTEP = 0.005
STOCK_PHASES = 8
# Nearby steps represent different phases of the contacts within a step.
PHASE_WIDTH = 0.02
# A ladder ends when the error is at most this many times the floor.
_FLOOR_SHARE = 3.0
# Largest share of the time that one run of the first pass may take.
_LONGEST_SHARE = 0.08
# Cost of a step of the reference engine over a step of LAMMPS, for planning only.
_IN_HOUSE_COST = 0.1


@dataclass(frozen=True)
class Setting:
    """One point of a work-precision study."""

    #: As in scenes.
    engine: Engine
    wall: Wall  #: As in scenes.
    scheme: Scheme  #: As in scenes.
    table: TableStyle | None  #: ``linear`` or ``spline``; None without a table.
    timestep: float  #: Composed step H.

    @property
    def series(self) -> str:
        """Name of the series: all settings of the study that differ only in the step."""
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
        Return the settings of one run.

        `bond_range` is the range of the table; None lets the engine find it. `phase`, from 0 to 1,
        shortens the step by up to 2 %.
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
    """Return the setting of the stock recipe, at a step in its unit of time."""
    spline: TableStyle | None = None if scene.bond.is_harmonic else "spline"
    return Setting("lammps", "reflect", "verlet", spline, step * time_unit(scene, "reflect"))


def time_unit(scene: Scene, wall: Wall) -> float:
    """
    Return the unit of time of steps, which makes them comparable between scenes.

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
_OTHER_ENDS = (0.8, 0.05)  # of schemes that have no entry
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
        """|Error of eta| of each phase, shape (phases,)."""
        return np.array([abs(each.restitution) for each in self.deviations])

    @property
    def median_error(self) -> float:
        """Median over the phases."""
        return float(np.median(self.errors))

    @property
    def rms_error(self) -> float:
        """Root of the mean square over the phases."""
        return float(np.sqrt(np.mean(self.errors**2)))

    @property
    def worst_error(self) -> float:
        """Largest over the phases."""
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
        """Median seconds of the integration."""
        return float(np.median(self.seconds))

    def run(self, truth: Truth, phase: float) -> None:
        """Run the setting again at a `phase` from 0 to 1, see :meth:`Setting.numerics`."""
        numerics = self.setting.numerics(truth.scene, truth.bond_range, phase)
        started, worked = time.perf_counter(), time.thread_time()
        try:
            outcome = _ENGINES[self.setting.engine].run(truth.scene.problem, numerics)
        except RunError as error:
            self.failure = str(error)
            return
        total, busy = time.perf_counter() - started, time.thread_time() - worked
        # Processor time excludes the load of other programs.
        integration = outcome.seconds * min(busy / total, 1.0)
        self.deviations.append(truth.deviation(outcome))
        self.seconds.append(integration)
        self.setup_seconds.append(max(busy - integration, 0.0))
        self.force_evaluations = outcome.force_evaluations
        self.table_points = outcome.details.get("table", {}).get("rows")


def measure_ladders(
    truth: Truth,
    ladders: list[list[Setting]],
    *,
    quick: bool,
    seconds: float,
    floor: float,
    advance: Callable[[float], None],
) -> list[Measurement]:
    """
    Run each ladder once from coarse to fine, then repeat all settings in turns.

    Returns all measured settings, coarse to fine within each series. Settings that do not fit into
    `seconds` of processor time are left out, the most expensive first. `floor` is the error of eta
    below which finer steps show nothing: the error bar of the reference run, and rounding.
    `advance` gets the fraction of the time that has passed.
    """
    for coarsest, *_ in ladders:
        # Compiled loops are loaded before the clock starts.
        if coarsest.engine == "reference":
            Measurement(coarsest).run(truth, 0.0)
    started = time.thread_time()

    def spent() -> float:
        # With processor time, other programs do not cause settings to be left out.
        return time.thread_time() - started

    def run(measurement: Measurement, phase: float) -> None:
        measurement.run(truth, phase)
        advance(min(1.0, spent() / seconds))

    # The first pass runs all ladders, cheapest step first, in half the time at most.
    measured: list[list[Measurement]] = [[] for _ in ladders]
    rungs = [(k, setting) for k, ladder in enumerate(ladders) for setting in ladder]
    rungs.sort(key=lambda rung: expected_seconds(truth, rung[1]))
    longest = _LONGEST_SHARE * seconds
    for k, setting in rungs:
        before = [m for m in measured[k] if m.failure is None]
        if before and before[-1].median_error < _FLOOR_SHARE * floor:
            continue
        expected = expected_seconds(truth, setting)
        if before and (expected > longest or spent() + expected > 0.6 * seconds):
            continue
        measurement = Measurement(setting)
        run(measurement, 0.0)
        measured[k].append(measurement)
    # Repeats in turns spread a slow moment of the machine over all settings.
    found = [m for series in measured for m in series]
    for turn in range(1, STOCK_PHASES):
        for measurement in found:
            # The stock wall's error is irregular.
            stock = measurement.setting.wall == "reflect"
            wanted = STOCK_PHASES if stock else 2 if quick else 4
            if turn >= wanted or measurement.failure or not measurement.seconds:
                continue
            if spent() + measurement.time > seconds:
                continue
            run(measurement, turn / (wanted - 1))
    return found


def expected_seconds(truth: Truth, setting: Setting) -> float:
    """Return the approximate seconds of one run of a setting, for planning."""
    numerics = setting.numerics(truth.scene)
    seconds = cost_model().integration(
        truth.scene.problem, numerics, truth.scouting.end.last_contact_time
    )
    if setting.engine == "reference":
        return _IN_HOUSE_COST * seconds
    return seconds if math.isfinite(seconds) else 0.0
