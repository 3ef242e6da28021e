"""Running settings in turns against the clock, and what came out of each."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.cost_model import cost_model
from chaincor.workflows.errors import RunError
from chaincor.workflows.tradeoff.settings import STOCK_PHASES, Setting, run_setting
from chaincor.workflows.tradeoff.truth import Deviation, Truth, deviation_from

# A ladder ends where the error has been this many times the floor's or less.
_FLOOR_SHARE = 3.0
# No single run of the first pass may take more than this part of the time.
_LONGEST_SHARE = 0.08
# In-house steps cost about this part of LAMMPS's; only the plan depends on it.
_IN_HOUSE_COST = 0.1


@dataclass
class Measurement:
    """Errors and times of one setting, gathered run by run."""

    setting: Setting  #: What was run.
    deviations: list[Deviation] = field(default_factory=list)  #: One for each phase.
    #: Processor time of the integration alone, one for each phase.
    seconds: list[float] = field(default_factory=list)
    #: Everything else: table, files, a new LAMMPS.
    setup_seconds: list[float] = field(default_factory=list)
    force_evaluations: int = 0  #: Of one run.
    table_points: int | None = None  #: Rows of its table.
    failure: str | None = None  #: Why it cannot be run.

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
        """Largest error of the last contact's time; inf where the number of contacts differs."""
        return max(each.last_contact_time for each in self.deviations)

    @property
    def mode_energy_error(self) -> float:
        """Largest error of a mode energy, in units of the energy at impact."""
        return max(each.mode_energies for each in self.deviations)

    @property
    def time(self) -> float:
        """Median seconds of the integration."""
        return float(np.median(self.seconds))

    def run(self, scene: Scene, truth: Truth, phase: float) -> None:
        """
        Run the setting once more.

        `phase` is from 0 to 1, see :meth:`Setting.numerics`.
        """
        numerics = self.setting.numerics(scene, truth.scouting.table_range(scene), phase)
        started, worked = time.perf_counter(), time.thread_time()
        try:
            outcome = run_setting(scene, self.setting.series, numerics)
        except RunError as error:
            self.failure = str(error)
            return
        total, busy = time.perf_counter() - started, time.thread_time() - worked
        # What the machine did for others meanwhile is no cost of the setting.
        integration = outcome.seconds * min(busy / total, 1.0)
        self.deviations.append(deviation_from(truth, scene, outcome))
        self.seconds.append(integration)
        self.setup_seconds.append(max(busy - integration, 0.0))
        self.force_evaluations = outcome.force_evaluations
        self.table_points = outcome.details.get("table", {}).get("rows")


def phases_of(setting: Setting, quick: bool) -> int:
    """Return how many phases to run: more for the stock wall, whose error is irregular."""
    stock = setting.series.wall == "reflect"
    return STOCK_PHASES if stock else 2 if quick else 4


def measure_ladders(
    scene: Scene,
    truth: Truth,
    ladders: list[list[Setting]],
    *,
    quick: bool,
    seconds: float,
    floor: float,
    advance: Callable[[float], None],
) -> list[Measurement]:
    """
    Climb down each ladder once, then repeat all settings in turns.

    Returns all settings that were run, coarse to fine within each series. What does not fit into
    `seconds` is left out, the most expensive first. `floor` is the error of eta below which finer
    steps say nothing: the truth's own bar, and rounding. `advance` is told the fraction of the time
    that is gone.
    """
    started = time.perf_counter()

    def spent() -> float:
        return time.perf_counter() - started

    # First down all ladders, cheapest step first: half the time at most.
    measured: list[list[Measurement]] = [[] for _ in ladders]
    rungs = [(k, setting) for k, ladder in enumerate(ladders) for setting in ladder]
    rungs.sort(key=lambda rung: expected_seconds(scene, truth, rung[1]))
    longest = _LONGEST_SHARE * seconds
    for k, setting in rungs:
        before = [m for m in measured[k] if m.failure is None]
        if before and before[-1].median_error < _FLOOR_SHARE * floor:
            continue
        expected = expected_seconds(scene, truth, setting)
        if before and (expected > longest or spent() + expected > 0.6 * seconds):
            continue
        measurement = Measurement(setting)
        measurement.run(scene, truth, 0.0)
        measured[k].append(measurement)
        advance(min(1.0, spent() / seconds))
    # Then again in turns, so that a slow moment of the machine hits all alike.
    found = [m for series in measured for m in series]
    for turn in range(1, STOCK_PHASES):
        for measurement in found:
            wanted = phases_of(measurement.setting, quick)
            if turn >= wanted or measurement.failure or not measurement.seconds:
                continue
            if spent() + measurement.time > seconds:
                continue
            measurement.run(scene, truth, turn / (wanted - 1))
            advance(min(1.0, spent() / seconds))
    return found


def expected_seconds(scene: Scene, truth: Truth, setting: Setting) -> float:
    """Return the seconds that one run of a setting should take, well enough for planning."""
    numerics = setting.numerics(scene)
    seconds = cost_model().integration(scene, numerics, truth.scouting.last_contact_time)
    if setting.series.engine == "reference":
        return _IN_HOUSE_COST * seconds
    return seconds if math.isfinite(seconds) else 0.0
