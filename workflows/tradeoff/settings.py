"""What is compared: engine, wall, scheme and table, and for each a ladder of steps."""

from dataclasses import dataclass

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import Engine, TableStyle, Wall
from chaincor.lammps_inputs.schemes import Scheme
from chaincor.workflows.accuracy.step_guess import sharpness
from chaincor.workflows.engines.in_house import stepping
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.outcome import Outcome

_ENGINE_NAMES = {"lammps": "LAMMPS", "reference": "in-house"}
# Force error of the linear tables that are compared with splines, in units of v0: some thousands
# of rows. Splines get as many rows as they need to be exact to rounding, which is fewer.
_LINEAR_FORCE_ERROR = 1e-7
# The recipe found in textbooks and on mailing lists: fix wall/reflect, Verlet, this step.
STOCK_TIMESTEP = 0.005
STOCK_PHASES = 8
# Nearby steps stand for different phases of the contacts within a step.
_PHASE_WIDTH = 0.02


@dataclass(frozen=True)
class Series:
    """Settings that differ in the step only."""

    #: As in scenes.
    engine: Engine
    wall: Wall  #: See ``engine``.
    scheme: Scheme  #: See ``engine``.
    table: TableStyle | None  #: ``linear`` or ``spline``; None where there is no table.

    @property
    def label(self) -> str:
        """Name for people."""
        parts = [_ENGINE_NAMES[self.engine]]
        if self.engine == "lammps":
            parts.append("stock wall" if self.wall == "reflect" else "event wall")
        parts.append(self.scheme)
        if self.table == "linear":
            parts.append("linear table")
        return ", ".join(parts)


@dataclass(frozen=True)
class Setting:
    """One point of a work-precision study."""

    series: Series  #: Engine, wall, scheme, table.
    timestep: float  #: The composed step H.

    def numerics(
        self, scene: Scene, bond_range: tuple[float, float] | None = None, phase: float = 0.0
    ) -> Numerics:
        """
        Return the settings of one run.

        `bond_range` is what the table must hold; None lets the engine find it. `phase`, from 0 to
        1, shortens the step by up to 2 %.
        """
        series = self.series
        return Numerics(
            wall=series.wall,
            scheme=series.scheme,
            timestep=self.timestep * (1.0 - _PHASE_WIDTH * phase),
            table=series.table or "spline",
            bond_range=bond_range,
            force_error=_LINEAR_FORCE_ERROR * scene.impact_velocity
            if series.table == "linear"
            else None,
        )


def run_setting(scene: Scene, series: Series, numerics: Numerics) -> Outcome:
    """Run a scene with a series' engine."""
    return (lammps if series.engine == "lammps" else stepping).run(scene, numerics)


def time_unit(scene: Scene, wall: Wall) -> float:
    """
    Return the time that steps are measured in, so that they mean the same in other scenes.

    It is 1/frequency of the most compressed bond; for the stock wall, whose recipe knows nothing of
    compression, of one at natural length.
    """
    unit = scene.bond.stiffness**-0.5
    return unit if wall == "reflect" else unit / sharpness(scene)


def _ladder(first: float, last: float, ratio: float) -> tuple[float, ...]:
    steps = [first]
    while steps[-1] / ratio > 0.99 * last:
        steps.append(steps[-1] / ratio)
    return tuple(steps)


_STOCK_STEPS = {
    False: (0.05, 0.02, 0.01, STOCK_TIMESTEP, 0.002, 0.001),
    True: (0.02, STOCK_TIMESTEP),
}
_EVENT_ENDS = {
    "verlet": (0.2, 0.003),
    "order4": (0.8, 0.05),
    "order6": (0.8, 0.07),
    "order8": (0.8, 0.1),
}
_NOT_WHEN_QUICK = {"lammps": ("order4",), "reference": ("verlet", "order4")}


def study_settings(scene: Scene, quick: bool) -> list[list[Setting]]:
    """Return the ladders of a study, one a series, each from coarse to fine."""
    tabulated = not scene.bond.is_harmonic
    spline: TableStyle | None = "spline" if tabulated else None
    ratio = 2.0 if quick else 2.0**0.5
    unit = time_unit(scene, "reflect")
    stock = Series("lammps", "reflect", "verlet", spline)
    ladders = [[Setting(stock, unit * step) for step in _STOCK_STEPS[quick]]]
    unit = time_unit(scene, "event")
    for engine in ("lammps", "reference"):
        for scheme, (first, last) in _EVENT_ENDS.items():
            if quick and scheme in _NOT_WHEN_QUICK[engine]:
                continue
            styles: tuple[TableStyle | None, ...] = (spline if engine == "lammps" else None,)
            if tabulated and engine == "lammps" and scheme in ("verlet", "order6") and not quick:
                styles = ("spline", "linear")
            for style in styles:
                series = Series(engine, "event", scheme, style)  # type: ignore[arg-type]
                steps = _ladder(first, last, ratio)
                ladders.append([Setting(series, unit * step) for step in steps])
    return ladders
