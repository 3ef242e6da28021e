"""Measuring, on this machine, each number of the cost model."""

import datetime
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from chaincor.lammps_inputs.bond_table import BondTable, tabulate
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import TableStyle
from chaincor.workflows.accuracy.cost_model import CostModel
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.versions import processor

_REPEATS = 7
_SHORT_CHAIN, _LONG_CHAIN = 20, 1000
_STEPS = {_SHORT_CHAIN: 20_000, _LONG_CHAIN: 1_000}
_ROWS = 1_001
# At rest but for a tremble: nothing leaves its table, nothing comes near the wall.
_TREMBLE = 1e-4


def calibrate(repeats: int = _REPEATS) -> CostModel:
    """
    Measure what LAMMPS costs, in some seconds.

    Every cost is the least of repeats that are taken in turns, in seconds of the processor: what
    else the machine does only adds to them.
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
    # Two lengths of chain tell a step's own cost from that of its bonds.
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
        measured_on=_machine(),
        step=step,
        harmonic_bond=harmonic,
        linear_bond=per_bond("linear long"),
        spline_bond=per_bond("spline long"),
        stage=max(cost["stage"] - per_step, 1e-8),
        contact=max((seconds - cost["setup"] - evaluations * per_step) / contacts, 1e-8),
    )


def _machine() -> str:
    return f"{datetime.date.today().isoformat()}, {processor()}"


def _scene(particles: int, style: TableStyle | None) -> Scene:
    potential = "harmonic" if style is None else "lj"
    return Scene(potential=potential, particles=particles, velocity=_TREMBLE)


def _table(scene: Scene, style: TableStyle | None, rows: int) -> BondTable | None:
    return None if style is None else tabulate(scene.bond, (0.9, 1.1), style, rows)


def _time_step(particles: int, style: TableStyle | None) -> float:
    """Return the seconds of one Verlet step inside a long run."""
    scene, numerics = _scene(particles, style), Numerics(scheme="verlet", timestep=1e-6)
    with (
        tempfile.TemporaryDirectory(prefix="chaincor-") as name,
        LammpsChain(scene, numerics, _table(scene, style, _ROWS), Path(name)) as chain,
    ):
        steps = _STEPS[particles]
        chain.run(max(steps // 20, 1))
        started = time.thread_time()
        chain.run(steps)
        return (time.thread_time() - started) / steps


def _time_stage() -> float:
    """Return the seconds of one stage of a composition, its step included, n = 100, harmonic."""
    scene, numerics = _scene(100, None), Numerics(scheme="order8", timestep=1e-6)
    steps = 60
    with (
        tempfile.TemporaryDirectory(prefix="chaincor-") as name,
        LammpsChain(scene, numerics, None, Path(name)) as chain,
    ):
        chain.step()
        done = chain.stages_done
        started = time.thread_time()
        for _ in range(steps):
            chain.step()
        return (time.thread_time() - started) / (chain.stages_done - done)


def _time_setup() -> float:
    """Return the seconds of setting a harmonic chain up, which a collision is timed with."""
    started = time.thread_time()
    with tempfile.TemporaryDirectory(prefix="chaincor-") as name:
        numerics = Numerics(scheme="verlet", timestep=1e-6)
        with LammpsChain(_scene(100, None), numerics, None, Path(name)):
            pass
    return time.thread_time() - started


def _time_collision() -> tuple[float, int, int]:
    """Return seconds, force evaluations and contacts of a collision with Verlet and its set-up."""
    scene = Scene(potential="harmonic", particles=100, velocity=0.1)
    started = time.thread_time()
    outcome = lammps.run(scene, Numerics(scheme="verlet", timestep=0.0125))
    seconds = time.thread_time() - started
    return seconds, outcome.force_evaluations, len(outcome.contact_times)
