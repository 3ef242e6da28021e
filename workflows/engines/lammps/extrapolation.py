"""An extrapolated step in LAMMPS: its parts are run, and their ends mixed, in one compiled loop."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house.compile import Keep, LoopCompiler
from chaincor.workflows.engines.in_house.loops.kept_loops import KeptLoop, tell_address
from chaincor.workflows.engines.schemes import Mixture

_COMMAND = "lammps_command"
# Rows of what a step remembers: the state before it, what its parts add to that, the masses.
_X, _V, _F, _SUM_X, _SUM_V, _SUM_F, _MASSES = range(7)

Array = NDArray[np.float64]


def build_step(command: Callable) -> Callable:
    """
    Return the loop of one extrapolated step.

    A part of m Verlet steps of H/m is run as m steps of H by particles that are :math:`m^2` times
    as heavy and 1/m times as fast: they go the same way. So LAMMPS's timestep, H, stays as it is;
    to change it takes as long as half a Verlet step of a hundred particles.

    Parameters
    ----------
    command : callable
        ``command(instance, text)``: LAMMPS carries out what is written at an address.

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


@lru_cache(maxsize=1)
def _loop() -> KeptLoop:
    compiler = LoopCompiler("lammps", Keep.ALL)
    return compiler.compile(build_step(compiler.register_foreign(_COMMAND)))


def extrapolated_step(instance: Any, mixture: Mixture, particles: int) -> Callable[[], None]:
    """
    Return what takes one step H by extrapolation, H being LAMMPS's timestep.

    Parameters
    ----------
    instance : lammps.lammps
        Set up, its forces those of its positions.
    mixture : Mixture
        In how many Verlet steps the step is taken, and with which weights.
    particles : int
        How many there are. All move along x.

    Returns
    -------
    callable
        Without arguments. What LAMMPS found wrong is to be asked of it afterwards.
    """
    tell_address(_COMMAND, instance.lib[_COMMAND])
    counts = mixture.counts.astype(int).tolist()
    runs = np.array([list(b"run %d pre no post no\0" % count) for count in counts], dtype=np.uint8)
    x, v, f = (instance.numpy.extract_atom(name, nelem=particles).reshape(-1) for name in "xvf")
    masses = instance.numpy.extract_atom("mass")
    scratch = np.empty((7, max(particles, len(masses))))
    parts = np.stack((mixture.counts, mixture.weights))
    return _loop().bound(instance.lmp.value, runs, parts, x, v, f, masses, scratch)
