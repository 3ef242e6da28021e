"""
The in-house engine against its peers, as ratios from one run.

    python tests/benchmarks/reference_peers.py [--quick] [--csv FILE]

Integrators are compared at equal error: for each, the coarsest setting from which on all finer
ones are within 1e-11 of a much tighter run. All integrate over the same time and only integration
is timed: compiling is apart. The loops over bonds are compared with the same loops in C, compiled
here with ``gcc -O3 -march=native``.
"""

import argparse
import csv
import ctypes
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from lammps_inputs.numerics import Numerics
from lammps_inputs.potentials import lj_force
from lammps_inputs.scene import Scene
from workflows.engines import reference
from workflows.engines.outcome import Outcome
from workflows.engines.reference_compile import LoopCompiler, ScalarForce
from workflows.engines.reference_stages import looped_stage

ERROR = 1e-11
REPEATS = 3
SPEEDS = (0.1, 0.4, 1.0)
HEYOKA_TOLERANCES = (1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14)

C_LOOPS = r"""
static inline double force(double s) {
    double w = 1.0 / (1.0 + s), w2 = w * w, w6 = w2 * w2 * w2;
    double rest = 6.0 + s * (15.0 + s * (20.0 + s * (15.0 + s * (6.0 + s))));
    return -s * rest * (w6 * w6 * w) * (1.0 / 6.0);
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


def best_time(function: Callable[[], object], repeats: int = REPEATS) -> float:
    """Return the shortest of a few times, the least disturbed by other work."""
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        function()
        times.append(time.perf_counter() - started)
    return min(times)


def run_ours(scene: Scene, step: float, scheme: str = "order8") -> Outcome:
    """Run the stepping engine."""
    return reference.run(scene, Numerics(scheme=scheme, timestep=step))


class HeyokaChain:
    """Heyoka's adaptive Taylor integrator in compact mode, with a terminal event at the wall."""

    def __init__(self, scene: Scene, tolerance: float) -> None:
        import heyoka as hy

        n = scene.particles
        u = hy.make_vars(*(f"u{i}" for i in range(n)))
        v = hy.make_vars(*(f"v{i}" for i in range(n)))
        inverse = [1.0 / (1.0 + u[i + 1] - u[i]) for i in range(n - 1)]
        force = [(w**13 - w**7) / 6.0 for w in inverse]
        zero = hy.expression(0.0)
        push = [(force[i - 1] if i else zero) - (force[i] if i < n - 1 else zero) for i in range(n)]

        def reflect(integrator, _direction):
            integrator.state[n] = abs(integrator.state[n])
            return True

        wall = hy.t_event(u[0], callback=reflect, direction=hy.event_direction.negative)
        self._start = np.concatenate((np.zeros(n), np.full(n, -scene.impact_velocity)))
        self._start[n] = scene.impact_velocity
        equations = [*zip(u, v, strict=True), *zip(v, push, strict=True)]
        self._integrator = hy.taylor_adaptive(
            equations, self._start, t_events=[wall], tol=tolerance, compact_mode=True
        )

    def run(self, duration: float) -> np.ndarray:
        """Return the velocities at the end."""
        self._integrator.time = 0.0
        self._integrator.state[:] = self._start
        self._integrator.reset_cooldowns()
        self._integrator.propagate_until(duration)
        return self._integrator.state[len(self._start) // 2 :].copy()


def run_dop853(scene: Scene, tolerance: float, duration: float) -> np.ndarray:
    """Return the velocities at the end from SciPy's DOP853 with a terminal event at the wall."""
    from scipy.integrate import solve_ivp

    n, v0 = scene.particles, scene.impact_velocity
    state = np.concatenate((np.zeros(n), np.full(n, -v0)))
    state[n] = v0
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
    now = 0.0
    while now < duration:
        flight = solve_ivp(
            motion, (now, duration), state, "DOP853", events=wall, rtol=tolerance,
            atol=tolerance * v0,
        )  # fmt: skip
        now, state = flight.t[-1], flight.y[:, -1]
        if flight.status == 1:
            state[0], state[n] = 0.0, abs(state[n])
    return state[n:]


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


def compare_integrators(speed: float) -> list[dict[str, float | str]]:
    """Return settings, errors and times of integrators at equal error, lj, n = 100."""
    scene = Scene(potential="lj", particles=100, speed=speed)
    tight = run_ours(scene, 0.0125)
    exact, duration = restitution(tight.velocities, scene), tight.duration
    rows: list[dict[str, float | str]] = []

    def add(name, settings, velocities_of, seconds_of):
        setting, error = coarsest(
            settings, lambda s: abs(restitution(velocities_of(s), scene) - exact)
        )
        seconds = seconds_of(setting)
        rows.append(
            {"speed": speed, "integrator": name, "setting": setting, "error": error}
            | {"ms": 1e3 * seconds}
        )

    for scheme, longest in (("order8", 0.2), ("extrapolated14", 0.8)):

        def seconds_of(step, scheme=scheme):
            runs = [run_ours(scene, step, scheme) for _ in range(10 * REPEATS)]
            # Peers integrate over exactly the same time.
            return min(run.seconds * duration / run.duration for run in runs)

        add(
            scheme,
            [longest / 2 ** (k / 4) for k in range(15)],
            lambda step, scheme=scheme: run_ours(scene, step, scheme).velocities,
            seconds_of,
        )
    chains = {tolerance: HeyokaChain(scene, tolerance) for tolerance in HEYOKA_TOLERANCES}
    add(
        "heyoka",
        HEYOKA_TOLERANCES,
        lambda tolerance: chains[tolerance].run(duration),
        lambda tolerance: best_time(lambda: chains[tolerance].run(duration)),
    )
    add(
        "dop853",
        (1e-9, 1e-10, 1e-11, 1e-12, 1e-13),
        lambda tolerance: run_dop853(scene, tolerance, duration),
        lambda tolerance: best_time(lambda: run_dop853(scene, tolerance, duration)),
    )
    for row in rows:
        row["over_order8"] = float(row["ms"]) / float(rows[0]["ms"])
        row["over_extrapolated14"] = float(row["ms"]) / float(rows[1]["ms"])
    return rows


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
            best[name] = min(best[name], best_time(run, 1))
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
