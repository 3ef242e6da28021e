r"""
One step of the chain away from the wall, made of Verlet steps: composed or extrapolated.

*Composition*: Verlet steps of w_k H one after the other. The map stays symmetric and symplectic.

*Extrapolation* (Gragg, Bulirsch and Stoer, with Störmer's rule): the step H is taken k times, as
1, 2, ... k Verlet steps. The error of each is a series in even powers of H/m, and the mixture

.. math:: z = \sum_m c_m z_m, \qquad c_m = \prod_{l \ne m} \frac{m^2}{m^2 - l^2},

is of order 2k. It takes k(k + 1)/2 evaluations of the forces for a step that may be ten times
longer than a composed one. Source: Hairer, Norsett and Wanner, Solving Ordinary Differential
Equations I, II.9 and II.14.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.engines.compositions import COMPOSITIONS

# Orders at which extrapolation is offered; rounding is amplified by the sum of |c_m|, 16 to 60.
_EXTRAPOLATED_ORDERS = (12, 14, 16)


@dataclass(frozen=True)
class StepScheme:
    """
    How a step is made of Verlet steps.

    Attributes
    ----------
    name : str
        As in `Numerics`, or ``extrapolated12`` and the like.
    order : int
        Order of the error of a run against H.
    extrapolated : bool
        Whether `outer` and `inner` mean weights and counts, or drifts and kicks.
    outer, inner : ndarray
        Composed: drifts w_1/2, (w_1 + w_2)/2, ..., w_s/2 and kicks w_k, in units of the step.
        Extrapolated: weights c_m and counts m.
    evaluations : int
        Force evaluations of one step.
    reach : int
        How many bonds away from particle 1 can act on it within one step.
    """

    name: str
    order: int
    extrapolated: bool
    outer: NDArray[np.float64]
    inner: NDArray[np.float64]
    evaluations: int
    reach: int


def _composed(name: str) -> StepScheme:
    composition = COMPOSITIONS[name]
    kicks = np.array(composition.weights)
    padded = np.concatenate(([0.0], kicks, [0.0]))
    drifts = 0.5 * (padded[:-1] + padded[1:])
    stages = composition.stages
    return StepScheme(name, composition.order, False, drifts, kicks, stages, stages + 1)


def _extrapolated(order: int) -> StepScheme:
    counts = range(1, order // 2 + 1)
    weights = [math.prod(m * m / (m * m - k * k) for k in counts if k != m) for m in counts]
    return StepScheme(
        f"extrapolated{order}",
        order,
        True,
        np.array(weights),
        np.array(counts, dtype=float),
        sum(counts),
        counts[-1] + 1,
    )


STEP_SCHEMES: dict[str, StepScheme] = {name: _composed(name) for name in COMPOSITIONS} | {
    f"extrapolated{order}": _extrapolated(order) for order in _EXTRAPOLATED_ORDERS
}


def composed_leap(start: Callable, stage: Callable, drift: Callable) -> Callable:
    """
    Return the composed map.

    Parameters
    ----------
    start, stage, drift : callable
        As in ``stages``.

    Returns
    -------
    callable
        ``leap(wall_distance, old, new, trial, bonds, wanted, step, scheme, parameters)``: writes
        the state after a step into `new` and returns the new distance of particle 1 from the wall.

        `old`, `new` and `trial` are (strain, velocity) pairs, the last one scratch; `bonds` are in
        motion, of which the first `wanted` are needed: each stage before the last moves one more.
        `scheme` is (outer, inner).
    """

    def leap(wall_distance, old, new, trial, bonds, wanted, step, scheme, parameters):
        drifts, kicks = scheme
        stages = kicks.shape[0]
        strain, velocity = new
        wall_distance += drifts[0] * step * old[1][0]
        reach = min(bonds, wanted + stages)
        start(
            old[0], old[1], strain, velocity, reach, drifts[0] * step, kicks[0] * step, parameters
        )
        for k in range(1, stages):
            wall_distance += drifts[k] * step * velocity[0]
            reach = min(bonds, wanted + stages - k)
            stage(strain, velocity, reach, drifts[k] * step, kicks[k] * step, parameters)
        wall_distance += drifts[-1] * step * velocity[0]
        drift(strain, velocity, min(bonds, wanted), drifts[-1] * step)
        return wall_distance

    return leap


def extrapolated_leap(start: Callable, stage: Callable, copy: Callable, mix: Callable) -> Callable:
    """
    Return the extrapolated map.

    Parameters
    ----------
    start, stage, copy, mix : callable
        As in ``stages``.

    Returns
    -------
    callable
        As :func:`composed_leap` returns it.
    """

    def leap(wall_distance, old, new, trial, bonds, wanted, step, scheme, parameters):
        weights, counts = scheme
        strain, velocity = trial
        wanted = min(bonds, wanted)
        copy(old[0], old[1], new[0], new[1], wanted)
        moved = 0.0
        for row in range(weights.shape[0]):
            weight = weights[row]
            count = int(counts[row])
            short = step / count
            half = 0.5 * short
            distance = half * old[1][0]
            reach = min(bonds, wanted + count)
            start(old[0], old[1], strain, velocity, reach, half, short, parameters)
            for further in range(count - 1, 0, -1):
                distance += short * velocity[0]
                stage(strain, velocity, min(bonds, wanted + further), short, short, parameters)
            distance += half * velocity[0]
            # Weights sum to 1: mixing differences keeps the rounding of what does not change out.
            mix(strain, velocity, old[0], old[1], wanted, half, weight, new[0], new[1])
            moved += weight * distance
        return wall_distance + moved

    return leap
