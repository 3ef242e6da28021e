"""The loops over a batch for one bond potential and kind of line, compiled."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.in_house.batch.end_bounds import is_over
from chaincor.workflows.engines.in_house.batch.lanes import build_lane_step
from chaincor.workflows.engines.in_house.batch.loop import build_carry
from chaincor.workflows.engines.in_house.coarse_steps import build_coarse_steps
from chaincor.workflows.engines.in_house.compile import KEPT, Keep, scalar_force
from chaincor.workflows.engines.in_house.kernels import made_for
from chaincor.workflows.engines.in_house.line_kinds import PLAIN, Kind
from chaincor.workflows.engines.schemes import StepScheme


def carry_for(bond: Potential, scheme: StepScheme, kind: Kind) -> Callable:
    """Return the loop, compiled once and cached on disk, of a bond whose force compiles."""
    force = scalar_force(bond)
    assert force is not None, "its force compiles"
    return _compile(force.function, force.keep, not scheme.extrapolated, kind)


@lru_cache(maxsize=KEPT)
def _compile(function: Callable, keep: Keep, split: bool, kind: Kind) -> Callable:
    compiler, (source, _) = made_for(function, keep, kind)
    step = compiler.register_long(build_lane_step(source, split))
    over = compiler.register_long(is_over)
    return compiler.compile(build_carry(source, step, over))


def look_ahead_for(bond: Potential) -> Callable:
    """
    Return the loop over look-ahead runs of plain chains, of a bond whose force compiles.

    ``look_ahead(ledgers, strains, velocities, counts, steps, clearances, done, parameters)`` lets
    each chain, a row of the arrays, take so many coarse steps while it keeps so clear of the wall;
    `done` is how many it took.
    """
    force = scalar_force(bond)
    assert force is not None, "its force compiles"
    return _compile_look_ahead(force.function, force.keep)


@lru_cache(maxsize=KEPT)
def _compile_look_ahead(function: Callable, keep: Keep) -> Callable:
    compiler, made = made_for(function, keep, PLAIN)
    take_coarse_steps = compiler.register(build_coarse_steps(*made))

    def look_ahead(
        ledgers: Any,
        strains: Array,
        velocities: Array,
        counts: NDArray[np.int64],
        steps: Array,
        clearances: Array,
        done: NDArray[np.int64],
        parameters: Any,
    ) -> None:
        for k in range(counts.shape[0]):
            asked = (counts[k], steps[k], clearances[k], True, True)
            done[k] = take_coarse_steps(ledgers[k], (strains[k], velocities[k]), asked, parameters)

    return compiler.compile(look_ahead)
