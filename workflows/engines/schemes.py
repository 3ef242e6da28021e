r"""
Define the steps of a chain away from the wall: split into drifts and kicks, or extrapolated.

*Splitting*: drifts and kicks alternate. Mostly they form consecutive Verlet steps of w_k H
(`Composition`). The map stays symmetric and symplectic. Other sequences of drifts and kicks are
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
from chaincor.lammps_inputs.schemes import (
    SCHEMES,
    Composition,
    ExtrapolatedSteps,
    SchemeFacts,
    SplitSteps,
)


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


def _scheme(name: str, facts: SchemeFacts) -> StepScheme:
    """Return the scheme of a declaration."""
    if isinstance(facts, Composition):  # consecutive Verlet steps with merged drifts
        weights = np.array(facts.weights)
        padded = np.concatenate(([0.0], weights, [0.0]))
        splitting = Splitting(0.5 * (padded[:-1] + padded[1:]), weights)
        return StepScheme(name, facts.order, splitting, build_split_step)
    if isinstance(facts, SplitSteps):
        drifts, kicks = facts.drifts, (*facts.kicks, 0.5 - sum(facts.kicks))
        splitting = Splitting(
            np.array((*drifts, 1.0 - 2.0 * sum(drifts), *reversed(drifts))),
            np.array((*kicks, *reversed(kicks))),
        )
        return StepScheme(name, facts.order, splitting, build_split_step)
    assert isinstance(facts, ExtrapolatedSteps)
    counts = facts.counts
    mixed = [math.prod(m * m / (m * m - k * k) for k in counts if k != m) for m in counts]
    extrapolation = Extrapolation(np.array(mixed), np.array(counts, dtype=float))
    return StepScheme(name, facts.order, extrapolation, build_extrapolated_step)


STEP_SCHEMES = {name: _scheme(name, facts) for name, facts in SCHEMES.items()}
