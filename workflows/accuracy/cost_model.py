"""Measure and forecast the time that LAMMPS runs take."""

import datetime
import json
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import cache
from importlib import resources
from pathlib import Path

from platformdirs import user_config_path

from chaincor.lammps_inputs.bond_table import tabulate
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import TableStyle
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.versions import processor

_FILE = "cost_model.json"
# For bodies of unequal masses, Python checks the gap before each Verlet step, because there is no
# bound on the time until their contact. A check takes as long as this many stages: 15 to 20 us,
# compared with 1.9 us for a stage.
_LOOK = 8.0
# Each time is measured _REPEATS times, with chains of two lengths that take _STEPS steps, and with
# tables of _ROWS rows.
_REPEATS = 7
_SHORT_CHAIN, _LONG_CHAIN = 20, 1000
_STEPS = {_SHORT_CHAIN: 20_000, _LONG_CHAIN: 1_000}
_ROWS = 1_001
# At this velocity a chain hardly moves: no bond leaves its table, and no particle comes near the
# wall.
_TREMBLE = 1e-4


# Seconds for one step with LAMMPS's granular styles, controlled from Python, and for each bead in
# this step.
_GRANULAR_STEP, _GRANULAR_BEAD = 6e-6, 9e-8


@dataclass(frozen=True)
class CostModel:
    """Times, in seconds, of the parts of a LAMMPS run."""

    measured_on: str  #: Date and machine of the measurement.
    step: float  #: Seconds for one Verlet step inside a run, without bonds.
    #: Seconds for one harmonic bond in one step.
    harmonic_bond: float
    linear_bond: float  #: Seconds for one bond with a linear table in one step.
    spline_bond: float  #: Seconds for one bond with a spline table in one step.
    #: Seconds that one stage of a composition, or one part of an extrapolated step, adds: a ``run``
    #: command, and the change of masses and velocities.
    stage: float
    #: Seconds that one contact adds to a run with Verlet steps: undone steps, the shortened step,
    #: and the reversal.
    contact: float

    def integration(self, problem: Problem, numerics: Numerics, duration: float) -> float:
        """
        Return the expected seconds for integrating a simulated time.

        The result does not include the motion after the last contact, because LAMMPS stops soon
        after it.
        """
        if problem.bond.only_pushes:
            per_step = _GRANULAR_STEP + _GRANULAR_BEAD * problem.all_particles
            return per_step * duration / numerics.timestep
        harmonic = problem.bond.is_harmonic
        per_bond = self.harmonic_bond if harmonic else getattr(self, f"{numerics.table}_bond")
        scheme = STEP_SCHEMES[numerics.scheme]
        # A free target has its own bonds. The number of contacts is limited by the shorter body.
        targets = problem.line.targets
        bonds = problem.particles - 1 + max(targets - 1, 0)
        contacts = 0.9 * (min(problem.particles, targets) if targets else problem.particles)
        per_step = scheme.evaluations * (self.step + per_bond * bonds)
        steps = duration / numerics.timestep
        if numerics.scheme == "verlet":
            if not problem.line.is_standard:
                per_step += _LOOK * self.stage
            return steps * per_step + contacts * self.contact
        # A contact costs about one additional step.
        return (steps + contacts) * (per_step + scheme.runs * self.stage)

    def save(self, path: Path) -> None:
        """Write the model to a file; create the folder if necessary."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(self), indent=2) + "\n")


def user_cost_model_path() -> Path:
    """Return the path to which ``chaincor tradeoff --calibrate`` writes this machine's model."""
    return user_config_path("chaincor") / _FILE


@cache
def cost_model() -> CostModel:
    """
    Return the cost model of this machine, or the model that comes with the program.

    If this machine's file cannot be used, a warning is printed to stderr.
    """
    path = user_cost_model_path()
    try:
        return CostModel(**json.loads(path.read_text()))
    except FileNotFoundError:
        pass
    except (OSError, ValueError, TypeError) as error:
        print(
            f"chaincor: the cost model {path} cannot be used ({error}), so forecasts use "
            "the built-in one. Write it anew with `chaincor tradeoff --calibrate`",
            file=sys.stderr,
        )
    return shipped_cost_model()


def shipped_cost_model() -> CostModel:
    """Return the cost model that comes with the program."""
    return CostModel(
        **json.loads(resources.files("chaincor.workflows.accuracy").joinpath(_FILE).read_text())
    )


def calibrate(repeats: int = _REPEATS) -> CostModel:
    """
    Measure the cost of LAMMPS on this machine, which takes some seconds.

    Every cost is the minimum of several alternating repeats, in processor seconds, because other
    work on the machine can only increase a time.
    """
    jobs: dict[str, Callable[[], float]] = {
        "harmonic short": lambda: _time_step(_SHORT_CHAIN, None),
        "harmonic long": lambda: _time_step(_LONG_CHAIN, None),
        "linear long": lambda: _time_step(_LONG_CHAIN, "linear"),
        "spline long": lambda: _time_step(_LONG_CHAIN, "spline"),
        "stage": _time_stage,
        "setup": _time_setup,
    }
    times: dict[str, list[float]] = {name: [] for name in jobs}
    collisions: list[tuple[float, int, int]] = []
    for _ in range(repeats):
        for name, job in jobs.items():
            times[name].append(job())
        collisions.append(_time_collision())
    cost = {name: min(values) for name, values in times.items()}
    # Chains of two lengths separate the cost of a step from the cost of its bonds.
    bonds = {_SHORT_CHAIN: _SHORT_CHAIN - 1, _LONG_CHAIN: _LONG_CHAIN - 1}
    harmonic = (cost["harmonic long"] - cost["harmonic short"]) / (
        bonds[_LONG_CHAIN] - bonds[_SHORT_CHAIN]
    )
    step = max(cost["harmonic short"] - harmonic * bonds[_SHORT_CHAIN], 1e-8)

    def per_bond(name: str) -> float:
        return (cost[name] - step) / bonds[_LONG_CHAIN]

    seconds, evaluations, contacts = min(collisions)
    per_step = step + harmonic * 99
    return CostModel(
        measured_on=f"{datetime.date.today().isoformat()}, {processor()}",
        step=step,
        harmonic_bond=harmonic,
        linear_bond=per_bond("linear long"),
        spline_bond=per_bond("spline long"),
        stage=max(cost["stage"] - per_step, 1e-8),
        contact=max((seconds - cost["setup"] - evaluations * per_step) / contacts, 1e-8),
    )


@contextmanager
def _chain(
    particles: int, style: TableStyle | None = None, scheme: StepSchemeName = "verlet"
) -> Iterator[LammpsChain]:
    """Set up a chain with harmonic bonds, or with a bond table of a given style."""
    potential = "harmonic" if style is None else "lj"
    problem = Scene(potential=potential, particles=particles, velocity=_TREMBLE).problem
    table = None if style is None else tabulate(problem.bond, (0.9, 1.1), style, _ROWS)
    numerics = Numerics(scheme=scheme, timestep=1e-6)
    with (
        tempfile.TemporaryDirectory(prefix="chaincor-") as name,
        LammpsChain(problem, numerics, table, Path(name)) as chain,
    ):
        yield chain


def _time_step(particles: int, style: TableStyle | None) -> float:
    """Return the seconds of one Verlet step inside a long run."""
    with _chain(particles, style) as chain:
        steps = _STEPS[particles]
        chain.run(max(steps // 20, 1))
        started = time.thread_time()
        chain.run(steps)
        return (time.thread_time() - started) / steps


def _time_stage() -> float:
    """Return the seconds of one stage of a composition, including its Verlet step, for n = 100."""
    steps = 60
    with _chain(100, scheme="order8") as chain:
        chain.step()
        done = chain.stages_done
        started = time.thread_time()
        for _ in range(steps):
            chain.step()
        return (time.thread_time() - started) / (chain.stages_done - done)


def _time_setup() -> float:
    """Return the seconds for setting up a harmonic chain, to be subtracted from a collision."""
    started = time.thread_time()
    with _chain(100):
        pass
    return time.thread_time() - started


def _time_collision() -> tuple[float, int, int]:
    """Return seconds (with set-up), force evaluations and contacts for a Verlet collision."""
    problem = Scene(potential="harmonic", particles=100, velocity=0.1).problem
    started = time.thread_time()
    outcome = lammps.run(problem, Numerics(scheme="verlet", timestep=0.0125))
    seconds = time.thread_time() - started
    return seconds, outcome.force_evaluations, len(outcome.contact_times)
