"""Observables that describe how a result was computed."""

from dataclasses import dataclass
from typing import Any

from chaincor.analysis.error_bar import ErrorBar
from chaincor.analysis.observed.observable import TextRow, observable
from chaincor.analysis.showing import lines
from chaincor.lammps_inputs.schemes import COMPOSITIONS


@dataclass(frozen=True, repr=False, kw_only=True)
class Making:
    """Engine, numerics and effort of a result."""

    tolerance: float | None = observable(
        "requested error of eta; null with explicit numerics", run=lambda r: r.asked
    )
    tolerance_met: bool | None = observable(
        "whether the error bar is within the tolerance", run=lambda r: r.tolerance_met
    )
    reason: str | None = observable(
        "reason why the tolerance is not met; null if it is met", run=lambda r: r.reason
    )
    error_parts: ErrorBar = observable("parts of eta's error bar, by cause", run=lambda r: r.bar)
    engine: str = observable(
        "engine that computed the motion: lammps, or reference, which is chaincor's own integrator",
        TextRow(
            "run by",
            lambda o: lines.run_text(
                o.engine,
                lines.contact_kind(
                    o.wall, soft=o.contact is not None, target=o.target_particles is not None
                ),
                o.scheme,
                o.timestep,
                None if o.table is None else f"{o.table} table of {o.table_points} rows",
            ),
            also=("wall", "scheme", "timestep", "table"),
            words=(
                *("engine", "wall", "scheme", "H", "event", "reflect", "reference", "lammps"),
                *("table", "event wall", "reflect wall"),
            ),
            closing=True,
        ),
        shared=True,
        run=lambda r: r.outcome.engine,
    )
    wall: str = observable(
        "treatment of the contact: event (located within a step) or reflect (LAMMPS's fix "
        "wall/reflect)",
        shared=True,
        run=lambda r: r.outcome.wall,
    )
    scheme: str = observable(
        f"integration scheme: {', '.join(COMPOSITIONS)}; or, if chosen for a tolerance, modal "
        "(exact, for harmonic bonds), srkn14 (order 6, 14 kicks), extrapolated12 or extrapolated14 "
        "(extrapolated Verlet steps), adaptive8 (for stiff bonds), hard-sphere (limit of high "
        "speed)",
        shared=True,
        run=lambda r: r.outcome.scheme,
    )
    timestep: float | None = observable(
        "time step, which is the length of a whole composed step; null for exact propagators and "
        "adaptive steps",
        unit="time",
        symbol="H",
        run=lambda r: r.outcome.timestep,
    )
    table: str | None = observable(
        "interpolation of the bond table; null without a table",
        shared=True,
        run=lambda r: r.table.get("style"),
    )
    table_points: int | None = observable(
        "number of rows of the bond table; null without a table",
        shared=True,
        run=lambda r: r.table.get("rows"),
    )
    duration: float = observable(
        "simulated time from the first contact to the end of the run",
        unit="time",
        run=lambda r: r.outcome.duration,
    )
    seconds: float = observable(
        "wall-clock time of the run that gave the result",
        TextRow(
            "time",
            "{0.seconds:.3g} s for this run, {0.seconds_total:.3g} s with set-up and checks",
            also=("seconds_total",),
            closing=True,
        ),
        unit="s",
        run=lambda r: r.outcome.seconds,
    )
    seconds_total: float = observable(
        "total wall-clock time, including set-up, tables and runs for the error bar",
        unit="s",
        run=lambda r: r.seconds_total,
    )
    scene_sha256: str = observable(
        "SHA-256 of all settings that determine the result", run=lambda r: r.scene.sha256
    )
    versions: dict[str, str] = observable(
        "versions of Python, chaincor and the libraries that computed the result",
        shared=True,
        run=lambda r: r.versions,
    )
    details: dict[str, Any] = observable(
        "further information about some runs: check of the table, choice of numerics, pilot run",
        run=lambda r: r.outcome.details | r.details,
    )
