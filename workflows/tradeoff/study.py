"""Run a trade-off study: reference run, settings, error budgets, tables and advice."""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import DEFAULT_TOLERANCE, Scene
from chaincor.lammps_inputs.scene_parts.given_bodies import given_bodies
from chaincor.lammps_inputs.scene_parts.scene_fields import Engine
from chaincor.workflows.engines.rounding import rounding_error
from chaincor.workflows.errors import RunError
from chaincor.workflows.given import scene_given
from chaincor.workflows.tradeoff.budget import (
    ErrorBudget,
    TablePoint,
    measure_budget,
    measure_tables,
)
from chaincor.workflows.tradeoff.front import (
    CheapestRow,
    advise_setting,
    advised,
    cheapest_settings,
)
from chaincor.workflows.tradeoff.reference_solution import ReferenceSolution, find_reference
from chaincor.workflows.tradeoff.settings import (
    STOCK_PHASES,
    Measurement,
    Setting,
    measure_ladders,
    stock_setting,
    study_settings,
)

ENGINES: tuple[Engine, ...] = ("lammps", "reference")


# Processor seconds for all settings together, and for one run with exact bonds or wider floats.
FULL, QUICK = (55.0, 12.0), (7.0, 5.0)


@dataclass(frozen=True)
class Tradeoff:
    """
    Result of a trade-off study.

    Attributes
    ----------
    scene : Scene
        The collision.
    reference : ReferenceSolution
        Converged values from the reference run.
    measurements : tuple of Measurement
        All measured settings.
    cheapest : dict
        Cheapest settings for each decade of error, by engine.
    budgets : tuple of ErrorBudget
        Error budgets of the advised setting and of the stock recipe.
    tables : tuple of TablePoint
        Effect of bond tables; empty for harmonic bonds.
    tolerance : float
        Tolerance that the advice meets.
    advice : str
        Advice in one line.
    seconds : float
        Wall-clock time of the study.
    """

    scene: Scene
    reference: ReferenceSolution
    measurements: tuple[Measurement, ...]
    cheapest: dict[str, list[CheapestRow]]
    budgets: tuple[ErrorBudget, ...]
    tables: tuple[TablePoint, ...]
    tolerance: float
    advice: str
    seconds: float

    @property
    def truth(self) -> ReferenceSolution:
        """Former name of `reference`."""
        warnings.warn("truth is now named reference", DeprecationWarning, stacklevel=2)
        return self.reference

    @property
    def stock(self) -> list[Measurement]:
        """Measurements with the stock reflecting wall."""
        return [m for m in self.measurements if m.setting.wall == "reflect" and m.seconds]

    @property
    def failed(self) -> list[Measurement]:
        """Settings whose runs failed."""
        return [m for m in self.measurements if m.failure]

    @property
    def own_tables(self) -> list[TablePoint]:
        """Results with linear tables over the bond lengths in this scene."""
        return [p for p in self.tables if p.style == "linear" and p.bond_range == "scene"]


# A function of this type reports the name of the current part and the finished fraction of the
# study.
StudyProgress = Callable[[str, float], None]


def tradeoff(
    scene: Scene, *, quick: bool = False, progress: StudyProgress = lambda _part, _done: None
) -> Tradeoff:
    """
    Measure error against time for a scene on this machine, like ``chaincor tradeoff``.

    Parameters
    ----------
    scene : Scene
        The collision. Numerics, engine and files of the scene are ignored. Its tolerance, by
        default 1e-6, is the tolerance for the advice.
    quick : bool
        Whether to measure fewer settings, which takes about 15 s instead of a minute or two.
    progress : callable, optional
        Function that is called with the name of each part and the finished fraction of the study.

    Returns
    -------
    Tradeoff
        Error and time of every measured setting, the cheapest setting for each decade of error, and
        one line of advice.

    Raises
    ------
    RunError
        If the collision does not converge, or if no setting could be run.
    InputError
        If the scene has masses, a target, a soft contact or an initial state.

    Examples
    --------
    >>> from chaincor import Scene, tradeoff
    >>> print(tradeoff(Scene(potential="harmonic", particles=4), quick=True).advice)
    1e-06 costs ... ms: ...
    """
    scene = scene_given(scene)
    if scene.bond.only_pushes:
        raise InputError(
            f"a study compares fixed steps, but steps for {scene.label} beads adapt "
            "to the overlaps. Choose another bond, or compare runs by --tolerance"
        )
    if not scene.line.is_standard:
        raise InputError(
            "tradeoff needs a chain of unit masses at rest and a hard wall. Leave "
            f"out {', '.join(given_bodies(scene))}, or compare runs with --scheme "
            "and --timestep"
        )
    started = time.perf_counter()
    ladder_seconds, oracle_seconds = QUICK if quick else FULL
    tolerance = scene.tolerance or DEFAULT_TOLERANCE
    scene = bare_scene(scene)
    progress("converged value", 0.0)
    reference = find_reference(scene)
    measurements = measure_ladders(
        reference,
        study_settings(scene, quick),
        quick=quick,
        seconds=ladder_seconds,
        floor=reference.restitution_error + 0.1 * rounding_error("lammps", scene.problem),
        advance=_share_of(progress, "settings", 0.05, 0.65),
    )
    if all(m.failure for m in measurements):
        raise RunError(f"no setting can run this scene: {measurements[0].failure}")
    cheapest: dict[str, list[CheapestRow]] = {
        engine: cheapest_settings(scene, measurements, engine) for engine in ENGINES
    }
    chosen = _setting_of(measurements, cheapest["lammps"], tolerance)
    budgets, tables = _find_causes(reference, chosen, oracle_seconds, quick, progress)
    progress("done", 1.0)
    return Tradeoff(
        scene=scene,
        reference=reference,
        measurements=tuple(measurements),
        cheapest=cheapest,
        budgets=budgets,
        tables=tables,
        tolerance=tolerance,
        advice=advise_setting(scene, cheapest["lammps"], tolerance),
        seconds=time.perf_counter() - started,
    )


def bare_scene(scene: Scene) -> Scene:
    """Return a LAMMPS scene with the physics of a scene, but without its numerics and files."""
    own = ("tolerance", "wall", "scheme", "timestep", "table", "table_points")
    open_fields = dict.fromkeys((*own, "dump", "save", "arrays"))
    return scene.replace(**open_fields, engine="lammps")


def _setting_of(
    measurements: list[Measurement], rows: list[CheapestRow], tolerance: float
) -> Setting | None:
    """Return the advised setting, or otherwise the most accurate setting of LAMMPS."""
    if row := advised(rows, tolerance):
        return row.setting
    usable = [m for m in measurements if not m.failure and m.setting.engine == "lammps"]
    return min(usable, key=lambda m: m.rms_error).setting if usable else None


def _find_causes(
    reference: ReferenceSolution,
    setting: Setting | None,
    oracle_seconds: float,
    quick: bool,
    progress: StudyProgress,
) -> tuple[tuple[ErrorBudget, ...], tuple[TablePoint, ...]]:
    if setting is None:
        return (), ()
    scene, numerics = reference.scene, setting.numerics(reference.scene, reference.bond_range)
    asked = [("advised", numerics, 1, 0.66, 0.74)]
    if not quick:
        stock = stock_setting(scene).numerics(scene, reference.bond_range)
        asked.append(("stock recipe", stock, STOCK_PHASES, 0.74, 0.9))
    budgets = tuple(
        measure_budget(
            reference,
            name,
            each,
            phases=phases,
            oracle_seconds=oracle_seconds,
            advance=_share_of(progress, "causes", first, last),
        )
        for name, each, phases, first, last in asked
    )
    tables: list[TablePoint] = []
    exact = budgets[0].exact_restitution
    if exact is not None and not scene.bond.is_harmonic:
        advance = _share_of(progress, "tables", 0.9, 1.0)
        tables = measure_tables(reference, numerics, exact, quick=quick, advance=advance)
    return budgets, tuple(tables)


def _share_of(
    progress: StudyProgress, part: str, first: float, last: float
) -> Callable[[float], None]:
    """Return a function that reports the finished fraction of one part."""
    return lambda done: progress(part, first + (last - first) * done)
