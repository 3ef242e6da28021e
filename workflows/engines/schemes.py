r"""
Define the steps of a chain away from the wall: split into drifts and kicks, or extrapolated.

*Splitting*: drifts and kicks alternate. Mostly they form consecutive Verlet steps of w_k H
(``compositions``). The map stays symmetric and symplectic. Other sequences of drifts and kicks are
possible as well, because forces depend on positions alone and the kinetic energy is quadratic.
LAMMPS cannot take such steps, because its Verlet steps fix the drifts beside each kick.

*Extrapolation* (Gragg, Bulirsch and Stoer, with Störmer's rule): the step H is taken k times, with
1, 2, ... k Verlet steps. The error of the result with m Verlet steps is a series in even powers of
H/m. The combination

.. math:: z = \sum_m c_m z_m, \qquad c_m = \prod_{l \ne m} \frac{m^2}{m^2 - l^2},

is of order 2k. With 1, 2, ... k Verlet steps, a step needs k(k + 1)/2 force evaluations, but may be
ten times longer than a composed step. If the numbers m differ more, a step needs more evaluations
and amplifies rounding errors less. Source: Hairer, Norsett and Wanner, Solving Ordinary
Differential Equations I, II.9 and II.14.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.compositions import COMPOSITIONS

# Extrapolation to order 12 repeats each step with 1, 2, 3, 4, 6 and 8 Verlet steps and combines the
# results; orders 14 and 16 use the other two tuples. Extrapolation multiplies rounding errors by
# the sum of |c_m|. For order 12 this sum is 8, because the last two numbers are 6 and 8; with the
# numbers 1 to 6 the sum would be 27. For orders 14 and 16 the sums are 56 and 116. LAMMPS uses
# order 12 because its coordinates are coarsely rounded.
_COUNTS = ((1, 2, 3, 4, 6, 8), tuple(range(1, 8)), tuple(range(1, 9)))

# SRKN14 of Blanes and Moan (2002), J. Comput. Appl. Math. 142, 313, table 3: fourteen stages,
# beginning with a drift. The middle drift and the two kicks beside it are computed below, from the
# conditions that the drifts sum to 1 and the kicks sum to 1.
_DRIFTS = (
    0.0378593198406116,
    0.102635633102435,
    -0.0258678882665587,
    0.314241403071447,
    -0.130144459517415,
    0.106417700369543,
    -0.00879424312851058,
)
_KICKS = (
    0.09171915262446165,
    0.183983170005006,
    -0.05653436583288827,
    0.004914688774712854,
    0.143761127168358,
    0.328567693746804,
)
_HALF = (*_KICKS, 0.5 - sum(_KICKS))


class StepCoefficients(NamedTuple):
    """Coefficients of a step."""

    fractions: (
        Any  #: Fractions for the function `take_step` of the scheme; Splitting or Extrapolation.
    )
    parameters: Any  #: Parameters of the potential for its force kernel; NamedTuple.


class Splitting(NamedTuple):
    """Fractions of a split step."""

    #: Drifts a_k; for a composition w_1/2, (w_1 + w_2)/2, ..., w_s/2; of shape (stages + 1,).
    drifts: Array
    kicks: Array  #: Kicks b_k; for a composition w_k; of shape (stages,).


class Extrapolation(NamedTuple):
    """Fractions of an extrapolated step."""

    weights: Array  #: Weights c_m; of shape (k,).
    counts: Array  #: Numbers m of Verlet steps; of shape (k,).


@dataclass(frozen=True, eq=False)
class StepScheme:
    """Scheme that builds a step H from drifts and kicks."""

    name: str  #: Name of the scheme in `Numerics`.
    order: int  #: Exponent p in the error of a run, which is proportional to H^p.
    fractions: Any  #: Fractions of the step; Splitting or Extrapolation.
    #: ``build_step(stages)`` builds the map over one step away from the contact from the
    #: `VerletKernels` of a potential (see ``reference.stages``). It returns ``take_step(position,
    #: old, new, trial, bonds, wanted, step, rule)``. This function takes one step from the `State`
    #: `old`, writes the result to `new` and returns the new distance of particle 1 from the wall;
    #: `trial` is scratch. Only `bonds` bonds are in motion. The caller needs only the first
    #: `wanted` of these bonds after the step. Each stage moves one bond more than the next stage,
    #: because the next stage needs its strain.
    build_step: Callable

    @property
    def extrapolated(self) -> bool:
        """Whether the scheme extrapolates; otherwise it splits."""
        return isinstance(self.fractions, Extrapolation)

    @cached_property
    def evaluations(self) -> int:
        """Force evaluations in one step: the number of stages, or the sum of all m."""
        fractions = self.fractions
        return int(np.sum(fractions.counts)) if self.extrapolated else len(fractions.kicks)

    @property
    def runs(self) -> int:
        """LAMMPS runs in one step: one for each m of an extrapolation, or one for each stage."""
        return len(self.fractions.counts) if self.extrapolated else self.evaluations

    @property
    def reach(self) -> int:
        """Number of bonds that can act on particle 1 within a step."""
        stages = self.fractions.counts[-1] if self.extrapolated else self.evaluations
        return int(stages) + 1

    @property
    def amplification(self) -> float:
        """Factor by which a step amplifies the rounding errors of its parts."""
        return float(np.sum(np.abs(self.fractions.weights))) if self.extrapolated else 1.0

    def shortest_stage(self, step: float) -> float:
        """Return the shortest Verlet step in a step H."""
        if self.extrapolated:
            return step / float(np.max(self.fractions.counts))
        return step * float(np.min(np.abs(self.fractions.kicks)))


def build_split_step(stages: Any) -> Callable:
    """Return the map of drifts and kicks, see `StepScheme`."""
    first, further, drift = stages.start, stages.stage, stages.drift

    def take_step(
        position: float,
        old: Any,
        new: Any,
        trial: Any,
        bonds: int,
        wanted: int,
        step: float,
        rule: StepCoefficients,
    ) -> float:
        drifts, kicks = rule.fractions
        parameters = rule.parameters
        strain, velocity = new
        count = kicks.shape[0]
        position += drifts[0] * step * old[1][0]
        reach = min(bonds, wanted + count)
        first(old, strain, velocity, reach, drifts[0] * step, kicks[0] * step, parameters)
        for k in range(1, count):
            position += drifts[k] * step * velocity[0]
            reach = min(bonds, wanted + count - k)
            further(strain, velocity, reach, drifts[k] * step, kicks[k] * step, parameters)
        position += drifts[-1] * step * velocity[0]
        drift(strain, velocity, min(bonds, wanted), drifts[-1] * step)
        return position

    return take_step


def build_extrapolated_step(stages: Any) -> Callable:
    """Return the extrapolated map, see `StepScheme`."""
    first, further, copy, mix = stages.start, stages.stage, stages.copy, stages.mix

    def take_step(
        position: float,
        old: Any,
        new: Any,
        trial: Any,
        bonds: int,
        wanted: int,
        step: float,
        rule: StepCoefficients,
    ) -> float:
        weights, counts = rule.fractions
        parameters = rule.parameters
        wanted = min(bonds, wanted)
        strain, velocity = trial
        copy(old[0], old[1], new, wanted)
        moved = 0.0
        for row in range(weights.shape[0]):
            weight = weights[row]
            count = int(counts[row])
            short = step / count
            half = 0.5 * short
            distance = half * old[1][0]
            first(old, strain, velocity, min(bonds, wanted + count), half, short, parameters)
            for left in range(count - 1, 0, -1):
                distance += short * velocity[0]
                further(strain, velocity, min(bonds, wanted + left), short, short, parameters)
            distance += half * velocity[0]
            # Add the weighted changes to the old state; this equals the weighted sum of the
            # results, because the weights sum to 1. Adding changes avoids rounding errors in values
            # that do not change.
            mix(trial, old, new, wanted, half, weight)
            moved += weight * distance
        return position + moved

    return take_step


def _composed(name: str) -> StepScheme:
    """Return the scheme of consecutive Verlet steps with merged drifts."""
    composition = COMPOSITIONS[name]
    kicks = np.array(composition.weights)
    padded = np.concatenate(([0.0], kicks, [0.0]))
    drifts = 0.5 * (padded[:-1] + padded[1:])
    return StepScheme(name, composition.order, Splitting(drifts, kicks), build_split_step)


def _extrapolated(counts: tuple[int, ...]) -> StepScheme:
    """Return the scheme of order 2k that extrapolates from k different numbers of Verlet steps."""
    order = 2 * len(counts)
    weights = [math.prod(m * m / (m * m - k * k) for k in counts if k != m) for m in counts]
    mixture = Extrapolation(np.array(weights), np.array(counts, dtype=float))
    return StepScheme(f"extrapolated{order}", order, mixture, build_extrapolated_step)


_SRKN14 = Splitting(
    np.array((*_DRIFTS, 1.0 - 2.0 * sum(_DRIFTS), *reversed(_DRIFTS))),
    np.array((*_HALF, *reversed(_HALF))),
)
_SCHEMES = (
    *map(_composed, COMPOSITIONS),
    StepScheme("srkn14", 6, _SRKN14, build_split_step),
    *map(_extrapolated, _COUNTS),
)
STEP_SCHEMES = {scheme.name: scheme for scheme in _SCHEMES}
