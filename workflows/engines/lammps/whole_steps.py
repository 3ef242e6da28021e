"""
Take composed or extrapolated steps as LAMMPS's Verlet steps with other masses and velocities.

A Verlet step of w H equals a Verlet step of H with masses multiplied by :math:`w^{-2}` and
velocities multiplied by w. LAMMPS's timestep H therefore never changes. Changing the timestep would
take as long as half a Verlet step of a hundred particles.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.reference.compile import LoopCompiler
from chaincor.workflows.engines.reference.loops.cached_kernels import (
    CachedKernel,
    set_symbol_address,
)
from chaincor.workflows.engines.schemes import StepScheme

_COMMAND = "lammps_command"
# Rows of the scratch array of an extrapolated step: position, velocity and force before the step,
# and the weighted sums of their changes.
_X, _V, _F, _SUM_X, _SUM_V, _SUM_F = range(6)


def build_composition(command: Callable) -> Callable:
    """
    Return the loop of one composed step, ``step(instance, run, weights, v, masses, true_masses)``.

    ``command(instance, text)`` makes LAMMPS execute the command string at the memory address
    `text`. `run` is the command that takes a Verlet step. `v` and `masses`, the masses of the atom
    types, are views of LAMMPS's memory.
    """

    def step(
        instance: int,
        run: NDArray[np.uint8],
        weights: Array,
        v: Array,
        masses: Array,
        true_masses: Array,
    ) -> None:
        before = 1.0
        for weight in weights:
            # If neighbouring weights are equal, masses and velocities need no change.
            if weight != before:
                faster = weight / before
                for i in range(len(v) // 3):
                    v[3 * i] *= faster
                for k in range(len(masses)):
                    masses[k] = true_masses[k] / (weight * weight)
                before = weight
            command(instance, run.ctypes.data)
        for i in range(len(v) // 3):
            v[3 * i] /= before
        for k in range(len(masses)):
            masses[k] = true_masses[k]

    return step


def build_extrapolation(command: Callable) -> Callable:
    """
    Return the loop of one extrapolated step.

    The loop is ``step(instance, runs, parts, x, v, f, masses, true_masses, scratch)``. Each row of
    `runs` is the command for one part; each column of `parts` contains the number m of Verlet steps
    and the weight of this part. The other arguments are explained in `build_composition`.
    """

    def step(
        instance: int,
        runs: NDArray[np.uint8],
        parts: Array,
        x: Array,
        v: Array,
        f: Array,
        masses: Array,
        true_masses: Array,
        scratch: Array,
    ) -> None:
        count = len(x) // 3
        for i in range(count):
            scratch[_X, i], scratch[_V, i], scratch[_F, i] = x[3 * i], v[3 * i], f[3 * i]
            scratch[_SUM_X, i] = scratch[_SUM_V, i] = scratch[_SUM_F, i] = 0.0
        for part in range(len(runs)):
            steps, weight = parts[0, part], parts[1, part]
            slower = 1.0 / steps
            for i in range(count):
                x[3 * i], v[3 * i] = scratch[_X, i], slower * scratch[_V, i]
                f[3 * i] = scratch[_F, i]
            for k in range(len(masses)):
                masses[k] = steps * steps * true_masses[k]
            command(instance, runs[part].ctypes.data)
            # Sum up weighted changes instead of weighted results; because the weights sum to 1,
            # both give the same state. Summing changes avoids rounding errors in values that hardly
            # change.
            for i in range(count):
                scratch[_SUM_X, i] += weight * (x[3 * i] - scratch[_X, i])
                scratch[_SUM_V, i] += weight * (steps * v[3 * i] - scratch[_V, i])
                scratch[_SUM_F, i] += weight * (f[3 * i] - scratch[_F, i])
        for k in range(len(masses)):
            masses[k] = true_masses[k]
        for i in range(count):
            x[3 * i] = scratch[_X, i] + scratch[_SUM_X, i]
            v[3 * i] = scratch[_V, i] + scratch[_SUM_V, i]
            f[3 * i] = scratch[_F, i] + scratch[_SUM_F, i]

    return step


@lru_cache
def _loop(build: Callable) -> CachedKernel:
    compiler = LoopCompiler("lammps", keep=True)
    return compiler.compile(build(compiler.register_foreign(_COMMAND)))


def whole_step(instance: Any, scheme: StepScheme, particles: int) -> Callable[[], None]:
    """
    Return a function that takes one step H of a scheme in a LAMMPS instance with timestep H.

    The scheme is an extrapolation or a composition of Verlet steps. The instance must have computed
    the forces at its positions and must have its permanent masses; all particles move along x. The
    caller must check LAMMPS for errors afterwards.
    """
    set_symbol_address(_COMMAND, instance.lib[_COMMAND])
    handle, masses = instance.lmp.value, instance.numpy.extract_atom("mass")
    x, v, f = (instance.numpy.extract_atom(name, nelem=particles).reshape(-1) for name in "xvf")
    if not scheme.extrapolated:
        run, weights = _as_array(run_command(1)), scheme.fractions.kicks
        return _loop(build_composition).bound(handle, run, weights, v, masses, masses.copy())
    counts, weights = scheme.fractions.counts, scheme.fractions.weights
    runs = np.array([_as_array(run_command(count)) for count in counts.astype(int).tolist()])
    parts, scratch = np.stack((counts, weights)), np.empty((6, particles))
    return _loop(build_extrapolation).bound(
        handle, runs, parts, x, v, f, masses, masses.copy(), scratch
    )


def run_command(steps: int) -> bytes:
    """Return the command that takes Verlet steps without set-up and output."""
    return b"run %d pre no post no" % steps


def _as_array(command: bytes) -> NDArray[np.uint8]:
    """Return a command as a zero-terminated byte array."""
    return np.frombuffer(command + b"\0", dtype=np.uint8)
