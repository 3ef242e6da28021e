"""Compare the reference engine's loops over bonds with the same loops in C."""

import ctypes
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.peers.integrators import timed
from chaincor.lammps_inputs.bonds.potential import NoParameters
from chaincor.lammps_inputs.bonds.potentials import lj_force
from chaincor.workflows.engines.reference.compile import LoopCompiler
from chaincor.workflows.engines.reference.line_traits import KernelSpec
from chaincor.workflows.engines.reference.stages import looped_stages

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


def compile_c(folder: Path) -> ctypes.CDLL:
    """Compile the loops in C and load them."""
    source, library = folder / "loops.c", folder / "loops.so"
    source.write_text(C_LOOPS)
    command = ["gcc", "-O3", "-march=native", "-shared", "-fPIC", str(source), "-o", str(library)]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(library))


def compile_ours() -> tuple[Callable, Callable]:
    """Return our loops, which are repeated in compiled code to avoid the cost of calls."""
    compiler = LoopCompiler.for_force(lj_force, keep=False)
    kernel, parameters = compiler.register(lj_force), NoParameters()
    stage = looped_stages(KernelSpec(kernel, compiler.register)).stage

    def forces(repeats, strain, force):
        for _ in range(repeats):
            for i in range(strain.shape[0]):
                force[i] = kernel(strain[i], parameters)

    def stages(repeats, strain, velocity, drift, kick):
        for _ in range(repeats):
            stage(strain, velocity, strain.shape[0], drift, kick, parameters)

    return compiler.compile(forces), compiler.compile(stages)


def compare_loops(particles: int, c_loops: ctypes.CDLL, ours: tuple) -> dict[str, float]:
    """Return nanoseconds per bond of a force loop and of a whole stage, for our loops and C."""
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
    for _ in range(7):  # all loops alternate, because the machine may be slow for a moment
        for name, run in runs.items():
            best[name] = min(best[name], timed(run))
    result = {"particles": float(particles)}
    result |= {f"{name}_ns": 1e9 * t / (repeats * bonds) for name, t in best.items()}
    result["force_ratio"] = best["force_ours"] / best["force_c"]
    result["stage_ratio"] = best["stage_ours"] / best["stage_c"]
    return result
