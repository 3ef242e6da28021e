"""
The in-house engine against its peers, as ratios from one run.

    python tests/benchmarks/reference_peers.py [--quick] [--csv FILE]

Integrators are compared at equal error of eta: for each, the coarsest setting from which on all
finer ones are within 1e-11 of a much tighter run. Only integration is timed: compiling is apart.
Times are those of the one thread that all of them use, medians of measurements taken in turns.
Three tasks are timed:

*last*: from the first contact to the last one, whose time the peers are told.
*whole*: with the showing that it was the last, which ends when silence or energy argue it (see
``ending``). Ours looks ahead with coarse steps, and peers are told the end and may do so too: from
the last contact on they integrate with the loose tolerance that is quickest for them.
*plain*: the same, but peers go on with the tolerance they have, as one would write it.

The loops over bonds are compared with the same loops in C, compiled here with
``gcc -O3 -march=native``.
"""

import argparse
import csv
import ctypes
import math
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import numpy as np

from lammps_inputs.numerics import Numerics
from lammps_inputs.potentials import lj_force
from lammps_inputs.scene import Scene
from workflows.engines import reference
from workflows.engines.kernels import kernels_for
from workflows.engines.outcome import Outcome
from workflows.engines.reference_chain import Chain
from workflows.engines.reference_compile import LoopCompiler, ScalarForce
from workflows.engines.reference_stages import looped_stage
from workflows.engines.reference_steps import STEP_SCHEMES

ERROR = 1e-11
REPEATS = 15
# What takes longer than this needs fewer repeats.
SLOW, SLOW_REPEATS = 0.3, 3
SPEEDS = (0.1, 0.4, 1.0)
# In half decades, as steps are in quarters of a halving.
HEYOKA_TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(18, 29))
DOP853_TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(20, 27))
# With which peers may look ahead.
LOOSE_TOLERANCES = (1e-3, 1e-5, 1e-7)
TASKS = ("last", "whole", "plain")

C_LOOPS = r"""
static inline double force(double s) {
    double w = 1.0 / (1.0 + s), w2 = w * w, w4 = w2 * w2;
    return (s * (1.0 + w) * (1.0 + w2 * (1.0 + w2))) * ((w4 * w4) * (-1.0 / 6.0));
}
void forces(long repeats, long bonds, const double *restrict s, double *restrict f) {
    for (long k = 0; k < repeats; ++k) {
        for (long i = 0; i < bonds; ++i) f[i] = force(s[i]);
        __asm__ volatile("" ::: "memory");
    }
}
void stages(long repeats, long bonds, double *restrict s, double *restrict v,
            double *restrict f, double drift, double kick) {
    for (long k = 0; k < repeats; ++k) {
        for (long i = 0; i < bonds; ++i) s[i] += drift * (v[i + 1] - v[i]);
        for (long i = 0; i < bonds; ++i) f[i + 1] = force(s[i]);
        for (long i = 0; i <= bonds; ++i) v[i] += kick * (f[i] - f[i + 1]);
        __asm__ volatile("" ::: "memory");
    }
}
"""


def restitution(velocities: np.ndarray, scene: Scene) -> float:
    """Return eta of final velocities."""
    return float((velocities.mean() / scene.impact_velocity) ** 2)


def timed(function: Callable[[], object]) -> float:
    """Return the seconds of the processor a call takes, whatever else the machine does."""
    started = time.thread_time()
    function()
    return time.thread_time() - started


def run_ours(scene: Scene, step: float, scheme: str = "order8") -> Outcome:
    """Run the stepping engine."""
    return reference.run(scene, Numerics(scheme=scheme, timestep=step))


def seconds_to_last_contact(scene: Scene, step: float, scheme: str, last: float) -> float:
    """Return the time the stepping engine takes up to a time, without arguing the end."""
    made_of = STEP_SCHEMES[scheme]
    kernels = kernels_for(scene.bond, made_of)
    chain = Chain.at_first_contact(scene, made_of)
    chain.ledger.patience = chain.ledger.argue_after = np.inf
    return timed(lambda: chain.advance(kernels, math.ceil(last / step), step, made_of))


class HeyokaChain:
    """Heyoka's adaptive Taylor integrator in compact mode, with a terminal event at the wall."""

    def __init__(self, scene: Scene, tolerance: float) -> None:
        import heyoka as hy

        n = scene.particles
        u = hy.make_vars(*(f"u{i}" for i in range(n)))
        v = hy.make_vars(*(f"v{i}" for i in range(n)))
        # Of the ways to write this force, the one heyoka is quickest with.
        length = [1.0 + (u[i + 1] - u[i]) for i in range(n - 1)]
        force = [(r**-13.0 - r**-7.0) / 6.0 for r in length]
        zero = hy.expression(0.0)
        push = [(force[i - 1] if i else zero) - (force[i] if i < n - 1 else zero) for i in range(n)]

        def reflect(integrator, _direction):
            integrator.state[n] = abs(integrator.state[n])
            return True

        wall = hy.t_event(u[0], callback=reflect, direction=hy.event_direction.negative)
        self.start = start_state(scene)
        equations = [*zip(u, v, strict=True), *zip(v, push, strict=True)]
        self._integrator = hy.taylor_adaptive(
            equations, self.start, t_events=[wall], tol=tolerance, compact_mode=True
        )

    def run(self, state: np.ndarray, begin: float, end: float) -> np.ndarray:
        """Return the state at the end."""
        self._integrator.time = begin
        self._integrator.state[:] = state
        self._integrator.reset_cooldowns()
        self._integrator.propagate_until(end)
        return self._integrator.state.copy()


def start_state(scene: Scene) -> np.ndarray:
    """Return displacements and velocities right after the first contact."""
    n, v0 = scene.particles, scene.impact_velocity
    state = np.concatenate((np.zeros(n), np.full(n, -v0)))
    state[n] = v0
    return state


class Dop853Chain:
    """SciPy's DOP853 with a terminal event at the wall."""

    def __init__(self, scene: Scene, tolerance: float) -> None:
        self.start = start_state(scene)
        self._tolerance, self._scene = tolerance, scene

    def run(self, state: np.ndarray, begin: float, end: float) -> np.ndarray:
        """Return the state at the end."""
        from scipy.integrate import solve_ivp

        n, tolerance = self._scene.particles, self._tolerance
        rates = np.empty(2 * n)

        def motion(_time, y):
            force = lj_force(np.diff(y[:n]), 0.0, 0.0)
            rates[:n] = y[n:]
            rates[n:] = 0.0
            rates[n:-1] -= force
            rates[n + 1 :] += force
            return rates.copy()

        def wall(_time, y):
            return y[0]

        wall.terminal, wall.direction = True, -1
        now = begin
        while now < end:
            flight = solve_ivp(
                motion, (now, end), state, "DOP853", events=wall, rtol=tolerance,
                atol=tolerance * self._scene.impact_velocity,
            )  # fmt: skip
            now, state = flight.t[-1], flight.y[:, -1]
            if flight.status == 1:
                state[0], state[n] = 0.0, abs(state[n])
        return state


def coarsest(settings: Iterable[float], error_of: Callable[[float], float]) -> tuple[float, float]:
    """Return the coarsest of settings, coarse to fine, from which on all are within the error."""
    chosen: tuple[float, float] | None = None
    for setting in settings:
        error = error_of(setting)
        if error > ERROR:
            chosen = None
        elif chosen is None:
            chosen = (setting, error)
    if chosen is None:
        raise RuntimeError(f"no setting is within {ERROR:g}")
    return chosen


def our_tasks(scene: Scene, scheme: str, step: float, last: float) -> dict[str, Callable]:
    """Return functions that time the tasks with the stepping engine."""

    def whole() -> float:
        return timed(lambda: run_ours(scene, step, scheme))

    to_last = partial(seconds_to_last_contact, scene, step, scheme, last)
    return {"last": to_last, "whole": whole, "plain": whole}


def peer_tasks(chain, loose_chains: Iterable, last: float, end: float) -> dict[str, Callable]:
    """Return functions that time the tasks with a peer; loose ones look ahead, the quickest."""
    state = chain.run(chain.start, 0.0, last)
    for loose in loose_chains:
        loose.run(state, last, end)
    quickest = min(loose_chains, key=lambda loose: timed(lambda: loose.run(state, last, end)))

    def to_last() -> float:
        return timed(lambda: chain.run(chain.start, 0.0, last))

    def look_ahead() -> float:
        return timed(lambda: quickest.run(chain.run(chain.start, 0.0, last), last, end))

    def plain() -> float:
        return timed(lambda: chain.run(chain.start, 0.0, end))

    return {"last": to_last, "whole": look_ahead, "plain": plain}


def compare_integrators(speed: float) -> list[dict[str, float | str]]:
    """Return settings, errors and times of integrators at equal error, lj, n = 100."""
    scene = Scene(potential="lj", particles=100, speed=speed)
    tight = run_ours(scene, 0.0125)
    exact, end = restitution(tight.velocities, scene), tight.duration
    # A little past the contact, so that those who see it a little later see it too.
    last = float(tight.contact_times[-1]) + 1e-3
    rows: list[dict[str, float | str]] = []
    tasks: list[dict[str, Callable]] = []

    def add(name, settings, velocities_of, tasks_of):
        setting, error = coarsest(
            settings, lambda s: abs(restitution(velocities_of(s), scene) - exact)
        )
        rows.append({"speed": speed, "integrator": name, "setting": setting, "error": error})
        tasks.append(tasks_of(setting))

    for scheme, longest in (("order8", 0.2), ("extrapolated14", 0.8)):
        add(
            scheme,
            [longest / 2 ** (k / 4) for k in range(15)],
            lambda step, scheme=scheme: run_ours(scene, step, scheme).velocities,
            lambda step, scheme=scheme: our_tasks(scene, scheme, step, last),
        )
    for name, kind, tolerances in (
        ("heyoka", HeyokaChain, HEYOKA_TOLERANCES),
        ("dop853", Dop853Chain, DOP853_TOLERANCES),
    ):
        chains = {tolerance: kind(scene, tolerance) for tolerance in tolerances}
        loose = [kind(scene, tolerance) for tolerance in LOOSE_TOLERANCES]
        add(
            name,
            tolerances,
            lambda tolerance, chains=chains: chains[tolerance].run(
                chains[tolerance].start, 0.0, last
            )[scene.particles :],
            lambda tolerance, chains=chains, loose=loose: peer_tasks(
                chains[tolerance], loose, last, end
            ),
        )
    add_times(rows, tasks)
    return rows


def add_times(rows: list[dict], tasks: list[dict[str, Callable]]) -> None:
    """Add the median times of the tasks, measured in turns, and their ratios to ours."""
    samples: dict = {(k, task): [] for k in range(len(rows)) for task in TASKS}
    for turn in range(REPEATS):
        for (k, task), times in samples.items():
            if turn < SLOW_REPEATS or times[0] < SLOW:
                times.append(tasks[k][task]())
    medians = {key: float(np.median(times)) for key, times in samples.items()}
    for k, row in enumerate(rows):
        row |= {f"{task}_ms": 1e3 * medians[k, task] for task in TASKS}
        row |= {f"{task}_over_8": medians[k, task] / medians[0, task] for task in TASKS}
        row |= {f"{task}_over_x14": medians[k, task] / medians[1, task] for task in TASKS}


def compile_c(folder: Path) -> ctypes.CDLL:
    """Compile the loops in C and load them."""
    source, library = folder / "loops.c", folder / "loops.so"
    source.write_text(C_LOOPS)
    command = ["gcc", "-O3", "-march=native", "-shared", "-fPIC", str(source), "-o", str(library)]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(library))


def compile_ours() -> tuple[Callable, Callable]:
    """Return our loops, repeated inside compiled code so that calls cost nothing."""
    compiler = LoopCompiler.for_force(ScalarForce(lj_force, (0.0, 0.0), keep=False))
    kernel = compiler.register(lj_force)
    stage = compiler.register(looped_stage(kernel))

    def forces(repeats, strain, force):
        for _ in range(repeats):
            for i in range(strain.shape[0]):
                force[i] = kernel(strain[i], 0.0, 0.0)

    def stages(repeats, strain, velocity, drift, kick):
        for _ in range(repeats):
            stage(strain, velocity, drift, kick, 0.0, 0.0)

    return compiler.compile(forces), compiler.compile(stages)


def compare_loops(particles: int, c_loops: ctypes.CDLL, ours: tuple) -> dict[str, float]:
    """Return nanoseconds per bond of the force loop and of a whole stage, ours and in C."""
    rng = np.random.default_rng(1)
    bonds, repeats = particles - 1, 2_000_000 // particles
    strain = rng.uniform(-0.01, 0.01, bonds)
    velocity = rng.uniform(-0.01, 0.01, particles)
    force = np.zeros(particles + 1)
    forces, stages = ours

    def pointer(array):
        return ctypes.c_void_p(array.ctypes.data)

    count, size, tiny = ctypes.c_long(repeats), ctypes.c_long(bonds), ctypes.c_double(1e-12)
    runs = {
        "force_ours": lambda: forces(repeats, strain, force),
        "force_c": lambda: c_loops.forces(count, size, pointer(strain), pointer(force)),
        "stage_ours": lambda: stages(repeats, strain, velocity, 1e-12, 1e-12),
        "stage_c": lambda: c_loops.stages(
            count, size, pointer(strain), pointer(velocity), pointer(force), tiny, tiny
        ),
    }
    for run in runs.values():
        run()
    best = dict.fromkeys(runs, np.inf)
    for _ in range(7):  # in turns, so that a slow moment of the machine hits all alike
        for name, run in runs.items():
            best[name] = min(best[name], timed(run))
    result = {"particles": float(particles)}
    result |= {f"{name}_ns": 1e9 * t / (repeats * bonds) for name, t in best.items()}
    result["force_ratio"] = best["force_ours"] / best["force_c"]
    result["stage_ratio"] = best["stage_ours"] / best["stage_c"]
    return result


def measure_scaling(sizes: Iterable[int]) -> list[dict[str, float]]:
    """Return the time of whole collisions over n^2, lj at 0.4 v*, order 6 at 0.1."""
    rows: list[dict[str, float]] = []
    for particles in sizes:
        scene = Scene(potential="lj", particles=particles, speed=0.4)
        outcome = reference.run(scene, Numerics(scheme="order6", timestep=0.1))
        # Time simulated per particle differs a little with when the end can be argued.
        per_square = outcome.seconds / (particles * outcome.duration)
        rows.append(
            {
                "particles": float(particles),
                "seconds": outcome.seconds,
                "duration": outcome.duration,
                "ns_per_particle_and_time": 1e9 * per_square,
                "over_first": per_square / (rows[0]["ns_per_particle_and_time"] * 1e-9)
                if rows
                else 1.0,
            }
        )
    return rows


def show(title: str, rows: list[dict]) -> None:
    """Print rows as a table."""
    print(f"\n{title}")
    print("  ".join(f"{name:>14}" for name in rows[0]))
    for row in rows:
        shown = (v if isinstance(v, str) else f"{v:.4g}" for v in row.values())
        print(
            "  ".join(
                f"{text:>{max(14, len(name))}}" for name, text in zip(row, shown, strict=True)
            )
        )


def main() -> None:
    """Run all comparisons."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("--csv", type=Path, help="also write every figure to this file")
    parser.add_argument("--quick", action="store_true", help="leave out the longest chains")
    arguments = parser.parse_args()

    tables: dict[str, list] = {
        "integrators at equal error": [
            row for speed in SPEEDS for row in compare_integrators(speed)
        ]
    }
    with tempfile.TemporaryDirectory() as folder:
        c_loops, ours = compile_c(Path(folder)), compile_ours()
        tables["loops, ns per bond"] = [
            compare_loops(particles, c_loops, ours) for particles in (100, 1000, 20000)
        ]
    sizes = (100, 300, 1000, 3000) if arguments.quick else (100, 300, 1000, 3000, 10000, 20000)
    tables["scaling"] = measure_scaling(sizes)
    for title, rows in tables.items():
        show(title, rows)
    if arguments.csv:
        with arguments.csv.open("w", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(["table", "row", "figure", "value"])
            for title, rows in tables.items():
                for number, row in enumerate(rows):
                    writer.writerows((title, number, name, value) for name, value in row.items())


if __name__ == "__main__":
    main()
