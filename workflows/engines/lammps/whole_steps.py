"""
A composed or extrapolated step in LAMMPS, all its Verlet steps sent from one compiled loop.

A Verlet step of w H is one of H by particles that are :math:`w^{-2}` times as heavy and w times as
fast: they go the same way. So LAMMPS's timestep, H, stays as it is; to change it takes as long as
half a Verlet step of a hundred particles.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house.compile import Keep, LoopCompiler
from chaincor.workflows.engines.in_house.loops.kept_loops import KeptLoop, tell_address
from chaincor.workflows.engines.schemes import Mixture

_COMMAND = "lammps_command"
# Rows of what an extrapolated step remembers: the state before it, what its parts add to that, and
# the masses.
_X, _V, _F, _SUM_X, _SUM_V, _SUM_F, _MASSES = range(7)

Array = NDArray[np.float64]


def build_composition(command: Callable) -> Callable:
    """
    Return the loop of one composed step.

    Parameters
    ----------
    command : callable
        ``command(instance, text)``: LAMMPS carries out what is written at an address.

    Returns
    -------
    callable
        ``step(instance, run, weights, v, masses, own_masses)``: `run` is the command of a Verlet
        step, `v` and the `masses` of LAMMPS's types are its own memory, `own_masses` is scratch.
    """

    def step(
        instance: int,
        run: NDArray[np.uint8],
        weights: Array,
        v: Array,
        masses: Array,
        own_masses: Array,
    ) -> None:
        for k in range(len(masses)):
            own_masses[k] = masses[k]
        before = 1.0
        for weight in weights:
            # Some weights come in pairs.
            if weight != before:
                faster = weight / before
                for i in range(len(v) // 3):
                    v[3 * i] *= faster
                for k in range(len(masses)):
                    masses[k] = own_masses[k] / (weight * weight)
                before = weight
            command(instance, run.ctypes.data)
        for i in range(len(v) // 3):
            v[3 * i] /= before
        for k in range(len(masses)):
            masses[k] = own_masses[k]

    return step


def build_extrapolation(command: Callable) -> Callable:
    """
    Return the loop of one extrapolated step.

    Parameters
    ----------
    command : callable
        As in `build_composition`.

    Returns
    -------
    callable
        ``step(instance, runs, parts, x, v, f, masses, scratch)``: a row of `runs` is the command
        of a part, a column of `parts` its m and its weight; `x`, `v`, `f` and the `masses` of
        LAMMPS's types are its own memory.
    """

    def step(
        instance: int,
        runs: NDArray[np.uint8],
        parts: Array,
        x: Array,
        v: Array,
        f: Array,
        masses: Array,
        scratch: Array,
    ) -> None:
        count = len(x) // 3
        for i in range(count):
            scratch[_X, i], scratch[_V, i], scratch[_F, i] = x[3 * i], v[3 * i], f[3 * i]
            scratch[_SUM_X, i] = scratch[_SUM_V, i] = scratch[_SUM_F, i] = 0.0
        for k in range(len(masses)):
            scratch[_MASSES, k] = masses[k]
        for part in range(len(runs)):
            steps, weight = parts[0, part], parts[1, part]
            slower = 1.0 / steps
            for i in range(count):
                x[3 * i], v[3 * i] = scratch[_X, i], slower * scratch[_V, i]
                f[3 * i] = scratch[_F, i]
            for k in range(len(masses)):
                masses[k] = steps * steps * scratch[_MASSES, k]
            command(instance, runs[part].ctypes.data)
            # Weights sum to 1: mixing differences keeps the rounding of what hardly changes out.
            for i in range(count):
                scratch[_SUM_X, i] += weight * (x[3 * i] - scratch[_X, i])
                scratch[_SUM_V, i] += weight * (steps * v[3 * i] - scratch[_V, i])
                scratch[_SUM_F, i] += weight * (f[3 * i] - scratch[_F, i])
        for k in range(len(masses)):
            masses[k] = scratch[_MASSES, k]
        for i in range(count):
            x[3 * i] = scratch[_X, i] + scratch[_SUM_X, i]
            v[3 * i] = scratch[_V, i] + scratch[_SUM_V, i]
            f[3 * i] = scratch[_F, i] + scratch[_SUM_F, i]

    return step


@lru_cache
def _loop(build: Callable) -> KeptLoop:
    compiler = LoopCompiler("lammps", Keep.ALL)
    return compiler.compile(build(compiler.register_foreign(_COMMAND)))


def composed_step(instance: Any, weights: tuple[float, ...], particles: int) -> Callable[[], None]:
    """
    Return what takes one composed step H, H being LAMMPS's timestep.

    Parameters
    ----------
    instance : lammps.lammps
        Set up, its forces those of its positions.
    weights : tuple of float
        Its Verlet steps, in units of H.
    particles : int
        How many there are. All move along x.

    Returns
    -------
    callable
        Without arguments. What LAMMPS found wrong is to be asked of it afterwards.
    """
    tell_address(_COMMAND, instance.lib[_COMMAND])
    masses = instance.numpy.extract_atom("mass")
    return _loop(build_composition).bound(
        instance.lmp.value,
        _command(1),
        np.array(weights),
        _flat(instance, "v", particles),
        masses,
        np.empty_like(masses),
    )


def extrapolated_step(instance: Any, mixture: Mixture, particles: int) -> Callable[[], None]:
    """
    Return what takes one step H by extrapolation, like `composed_step`.

    Parameters
    ----------
    instance : lammps.lammps
        As there.
    mixture : Mixture
        In how many Verlet steps the step is taken, and with which weights.
    particles : int
        As there.

    Returns
    -------
    callable
        As there.
    """
    tell_address(_COMMAND, instance.lib[_COMMAND])
    x, v, f = (_flat(instance, name, particles) for name in "xvf")
    masses = instance.numpy.extract_atom("mass")
    scratch = np.empty((7, max(particles, len(masses))))
    parts = np.stack((mixture.counts, mixture.weights))
    runs = np.array([_command(count) for count in mixture.counts.astype(int).tolist()])
    return _loop(build_extrapolation).bound(
        instance.lmp.value, runs, parts, x, v, f, masses, scratch
    )


def _command(steps: int) -> NDArray[np.uint8]:
    """Return the command of some Verlet steps, as LAMMPS's library reads it."""
    return np.frombuffer(b"run %d pre no post no\0" % steps, dtype=np.uint8).copy()


def _flat(instance: Any, name: str, particles: int) -> Array:
    """Return x, v or f of all particles where LAMMPS has them, one after the other."""
    return instance.numpy.extract_atom(name, nelem=particles).reshape(-1)
