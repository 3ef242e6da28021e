"""Find the Pareto front of a study, the cheapest setting for each decade of error, and advice."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import Engine
from chaincor.lammps_inputs.schemes import COMPOSITIONS, Scheme
from chaincor.workflows.accuracy.by_lammps import usual_schemes
from chaincor.workflows.measured import measured
from chaincor.workflows.tradeoff.settings import Measurement, Setting, time_unit

# The promised error of a setting is the largest measured error times this factor, by scheme. Errors
# at equal steps (in units of the fastest bond) scatter between scenes, because contacts may graze
# the wall. For 95 of 100 scenes, the error is below the promised one. No factor is smaller than the
# factor from the 130 scenes of the first study.
RESERVE: dict[Scheme, float] = measured(
    "promise_reserve", {"verlet": 40.0, "order4": 20.0, "order6": 20.0, "order8": 20.0}
)
LOOSEST_DECADE, TIGHTEST_DECADE = 2, 13


def reserve_of(scheme: Scheme) -> float:
    """Return the factor for a scheme; if the scheme was not measured, return the largest factor."""
    return RESERVE.get(scheme, max(RESERVE.values()))


def promised_errors(measurements: Iterable[Measurement]) -> dict[Setting, float]:
    """
    Return the error that each setting promises for this scene and similar scenes.

    The error at one step may be small by chance. The promised error is therefore the largest error
    of the setting's series at this step and at smaller steps, times the factor for the scheme.
    """
    promises: dict[Setting, float] = {}
    largest: dict[str, float] = {}
    done = [m for m in measurements if m.failure is None]
    for each in sorted(done, key=lambda m: m.setting.timestep):
        series = each.setting.series
        largest[series] = max(each.worst_error, largest.get(series, 0.0))
        promises[each.setting] = reserve_of(each.setting.scheme) * largest[series]
    return promises


def pareto_front(measurements: Iterable[Measurement]) -> list[Measurement]:
    """Return the settings that no other setting beats in both error and time, fastest first."""
    front: list[Measurement] = []
    done = [m for m in measurements if m.failure is None]
    for each in sorted(done, key=lambda m: (m.time, m.rms_error)):
        if not front or each.rms_error < front[-1].rms_error:
            front.append(each)
    return front


@dataclass(frozen=True)
class CheapestRow:
    """Cheapest setting for a decade of error."""

    error: float  #: Promised error, 10^-k.
    setting: Setting  #: Setting, with its step in the measured scene.
    #: Step times the frequency of the fastest bond, for use in other scenes.
    scaled_timestep: float
    measured_error: float  #: Largest error over the phases.
    #: Largest error in the time of the last contact.
    contact_time_error: float
    #: Largest error of a mode energy, as a fraction of the energy at impact.
    mode_energy_error: float
    seconds: float  #: Median time of the integration.


def cheapest_settings(
    scene: Scene, measurements: Iterable[Measurement], engine: Engine
) -> list[CheapestRow]:
    """Return an engine's cheapest setting for each decade of the error in eta, from 1e-2 down."""
    usable = [m for m in measurements if m.failure is None and m.setting.engine == engine]
    promises = promised_errors(usable)
    rows = []
    for decade in range(LOOSEST_DECADE, TIGHTEST_DECADE + 1):
        error = 10.0**-decade
        good = [m for m in usable if promises[m.setting] <= error]
        if not good:
            break
        best = min(good, key=lambda m: m.time)
        rows.append(
            CheapestRow(
                error=error,
                setting=best.setting,
                scaled_timestep=best.setting.timestep / time_unit(scene, best.setting.wall),
                measured_error=best.worst_error,
                contact_time_error=best.contact_time_error,
                mode_energy_error=best.mode_energy_error,
                seconds=best.time,
            )
        )
    return rows


def advised(rows: list[CheapestRow], tolerance: float) -> CheapestRow | None:
    """Return the cheapest row that meets a tolerance; None if no row does."""
    good = [row for row in rows if row.error <= tolerance * (1.0 + 1e-9)]
    return min(good, key=lambda row: row.seconds, default=None)


def advise_setting(scene: Scene, rows: list[CheapestRow], tolerance: float) -> str:
    """Write one line on the cost of the tolerance, and on a quicker setting if there is one."""
    row = advised(rows, tolerance)
    # A study compares only schemes that a script can have. With a tolerance, LAMMPS may use other
    # schemes, such as extrapolation.
    has_more = usual_schemes(scene.problem, tolerance)[0] not in COMPOSITIONS
    if row is None:
        reached = f"{rows[-1].error:.0e}" if rows else "nothing"
        more = f"; --tolerance {tolerance:.0e} may reach it" if has_more else ""
        return f"no measured setting has an error of {tolerance:.0e} (reached: {reached}){more}"
    more = f"; quicker: --tolerance {tolerance:.0e}" if has_more else ""
    setting = describe_setting(row.setting)
    return f"{tolerance:.0e} costs {format_seconds(row.seconds)}: {setting}{more}"


def describe_setting(setting: Setting) -> str:
    """Describe a setting by a few words."""
    return f"{setting.series}, H {setting.timestep:.3g}"


def format_seconds(seconds: float) -> str:
    """Format a time with two digits and a unit, such as ``60 ms``."""
    if seconds >= 1.0:
        return f"{seconds:.2g} s"
    digits = max(0, 1 - math.floor(math.log10(max(1e3 * seconds, 1e-9))))
    return f"{1e3 * seconds:.{digits}f} ms"
