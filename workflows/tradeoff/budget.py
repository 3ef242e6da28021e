"""The error of a setting apart by cause: each cause by the run that lacks it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.in_house_runs import eta_of
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.tradeoff.oracles import (
    lepton_formula,
    restitution_with_exact_bonds,
    restitution_without_rounding,
    wider_floats,
)
from chaincor.workflows.tradeoff.truth import Truth

# Seconds per force call of bond_style lepton, and per step in NumPy: for planning.
_LEPTON_CALL = 2e-4
_WIDE_STAGE = 3e-5

CAUSES = ("wall", "integrator", "table", "rounding", "output")


@dataclass(frozen=True)
class ErrorBudget:
    """Error of eta by cause."""

    name: str  #: What the budget is of.
    scheme: str  #: Its scheme.
    timestep: float  #: Its composed step H.
    #: Stock wall less event wall at the same steps, root mean square over phases; None for the
    #: event wall, which is located to rounding.
    wall: float | None
    integrator: float | None  #: Event wall, exact bonds and no rounding, less the truth.
    #: Table less exact bonds, at the same steps; None where there is no formula or no time.
    table: float | None
    #: Doubles less wider floats, at the same steps; None where this machine has none.
    rounding: float | None
    #: eta from final velocities as a default dump prints them (six digits), less eta.
    output: float
    output_exact: float  #: The same as this program's dumps print them (17 digits).
    total: float  #: The setting's whole error.
    #: eta of these steps with exact bonds, for the study of tables.
    exact_restitution: float | None

    def parts(self) -> dict[str, float | None]:
        """Return the errors by cause."""
        return {cause: getattr(self, cause) for cause in CAUSES}


def printed_restitution(scene: Scene, outcome: Outcome, pattern: str) -> float:
    """Return eta from final velocities printed in a dump with a format such as ``%g``."""
    printed = np.array([float(pattern % v) for v in outcome.velocities])
    return float(restitution(printed, scene.impact_velocity))


def measure_budget(
    scene: Scene,
    truth: Truth,
    name: str,
    numerics: Numerics,
    *,
    phases: int,
    oracle_seconds: float,
    advance: Callable[[], None] = lambda: None,
) -> ErrorBudget:
    """
    Take the causes of error away one after the other.

    Errors have signs: those of one event-wall run add up to its whole error. `phases` nearby steps
    average the stock wall's; `oracle_seconds` is what the slow runs with exact bonds and with wider
    floats may take each.
    """
    wall = None
    event = replace(numerics, wall="event")
    full = lammps.run(scene, numerics)
    total = eta_of(scene, full) - truth.restitution
    advance()
    located = full
    if numerics.wall == "reflect":
        located = lammps.run(scene, event)
        differences = [total]
        wall_errors = [eta_of(scene, full) - eta_of(scene, located)]
        for phase in range(1, phases):
            step = numerics.timestep * (1.0 - 0.02 * phase / phases)
            stock = lammps.run(scene, replace(numerics, timestep=step))
            other = lammps.run(scene, replace(event, timestep=step))
            wall_errors.append(eta_of(scene, stock) - eta_of(scene, other))
            differences.append(eta_of(scene, stock) - truth.restitution)
            advance()
        wall = float(np.sqrt(np.mean(np.square(wall_errors))))
        total = float(np.sqrt(np.mean(np.square(differences))))
    tabulated = not scene.bond.is_harmonic
    exact = eta_of(scene, located)
    table: float | None = 0.0
    if tabulated:
        table = None
        fits = _LEPTON_CALL * located.force_evaluations < oracle_seconds
        if fits and lepton_formula(scene) is not None:
            exact = restitution_with_exact_bonds(scene, event, located)
            table = abs(eta_of(scene, located) - exact)
        advance()
    integrator = rounding = None
    if wider_floats() and _WIDE_STAGE * located.force_evaluations < oracle_seconds:
        smooth = restitution_without_rounding(scene, event, located)
        integrator = abs(smooth - truth.restitution)
        # Without exact bonds the difference would hold the table's error as well.
        rounding = None if table is None else abs(exact - smooth)
    advance()
    return ErrorBudget(
        name=name,
        scheme=numerics.scheme,
        timestep=numerics.timestep,
        wall=wall,
        integrator=integrator,
        table=table,
        rounding=rounding,
        output=abs(printed_restitution(scene, full, "%g") - eta_of(scene, full)),
        output_exact=abs(printed_restitution(scene, full, "%.17g") - eta_of(scene, full)),
        total=abs(total),
        exact_restitution=None if table is None else exact,
    )
