"""Guess, without a run, the step with which the reference engine reaches a target error."""

import math
from collections.abc import Iterable
from functools import cache

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.schemes import DEFAULT_TIMESTEPS, StepSchemeName
from chaincor.workflows.engines.compositions import COMPOSITIONS
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.measured import measured

# Steps may use half of the target error, because the error bar needs room for its other parts. The
# share affects only the cost, because the sum is proved.
STEP_SHARE = 0.5
# A stage of weight w is stable while 2 |w| H < 2 for the fastest mode. The share stays a tenth
# below this limit.
_STABILITY_SHARE = 0.9
# A bond that is compressed to a curvature k needs steps shorter by sqrt(k). This table has the
# steps of DEFAULT_TIMESTEPS and steps of schemes without a default, each with the error of eta that
# it gives for chains of about 100 particles. Only the first guess depends on them.
USUAL_STEPS: dict[str, float] = {
    **DEFAULT_TIMESTEPS,
    "srkn14": 1.0,
    "extrapolated12": 0.6,
    "extrapolated14": 0.8,
}
_USUAL_ERROR: dict[str, float] = measured("usual_error")
# The first number replaces the order of schemes whose order holds only for shorter steps. The
# second number is the error below which nine scenes in ten stay, divided by the median error, for
# schemes in which it is not about two.
_USUAL_ORDERS = {"srkn14": 9}
_USUAL_SCATTER = {"srkn14": 20.0}
# Error of eta with LAMMPS's granular styles, divided by the square of the step in units of
# 1/frequency. It is 0.03 for columns of 10 beads and 0.06 for columns of 100.
_GRANULAR_ERROR = 0.06
# With damping the error of eta is divided by the step instead: 0.001 to 0.1. Refinement finds
# shorter steps.
_DAMPED_ERROR = 0.01
# Largest steps of schemes that are no compositions: up to their limit of stability, and in LAMMPS
# while their longest Verlet step does not need a much longer bond table.
_LARGEST = {"srkn14": 1.4, "extrapolated12": 0.7, "extrapolated14": 1.2}


def frequency_ratio(problem: Problem) -> float:
    """
    Return the frequency of the most compressed bond, or a soft contact, over its value at rest.

    It is sqrt(U''(shortest)/U''(1)), 1 or more, with a guess of the shortest bond.
    """
    line, bond = problem.line, problem.bond
    if bond.only_pushes:
        return 1.0  # the stiffness at the scale of the scene, not at rest
    sharpest = 1.0
    if line.heaviest_pair > 0.0:
        energy = pair_energy(line)
        # An object of a user may not be hashable.
        if problem.named:
            if (bond, energy) not in _compressed:
                _keep_compressed(bond, [energy])
            strain, curvature = _compressed[bond, energy]
        else:
            strain, curvature = _compressed_by(bond, [energy])[0]
        if not line.cold:
            shortest = float(np.min(np.delete(line.strains, line.gap)))
            if shortest < strain:
                curvature = float(bond.curvature(shortest))
        sharpest = max(1.0, curvature / bond.stiffness)
    if line.soft:
        sharpest = max(sharpest, line.contact_rate / problem.fast_stiffness)
    return math.sqrt(sharpest)


def foresee_frequency_ratio(problems: Iterable[Problem]) -> None:
    """Compute the frequency ratios of many problems at once, in a tenth of the time."""
    energies: dict[Potential, set[float]] = {}
    for problem in problems:
        if problem.named and problem.line.heaviest_pair > 0.0:
            energies.setdefault(problem.bond, set()).add(pair_energy(problem.line))
    for bond, asked in energies.items():
        if new := [energy for energy in asked if (bond, energy) not in _compressed]:
            _keep_compressed(bond, new)


def pair_energy(line: Line) -> float:
    """Return the energy of the bond between two particles that collide at 2 v0."""
    return 2.0 * line.heaviest_pair * (line.largest_speed * line.largest_speed)


# The cache holds the strain of bonds that hold an energy, and U'' there, because a sweep needs the
# same speeds for many lengths.
_compressed: dict[tuple[Potential, float], tuple[float, float]] = {}
_MOST_KEPT = 100_000


def _keep_compressed(bond: Potential, energies: list[float]) -> None:
    if len(_compressed) > _MOST_KEPT:
        _compressed.clear()
    found = _compressed_by(bond, energies)
    _compressed.update(((bond, e), each) for e, each in zip(energies, found, strict=True))


def _compressed_by(bond: Potential, energies: list[float]) -> list[tuple[float, float]]:
    strains = bond.compressed_strains(np.array(energies)).tolist()
    return [(strain, float(bond.curvature(strain))) for strain in strains]


def contact_is_stiffest(problem: Problem) -> bool:
    """Return whether the contact of soft bodies, not a bond, has the highest frequency."""
    if not problem.line.soft:
        return False
    return frequency_ratio(problem) <= math.sqrt(problem.line.contact_rate / problem.fast_stiffness)


def is_smooth(problem: Problem) -> bool:
    """Return whether schemes keep their order: neither bonds nor a soft contact have kinks."""
    return problem.bond.smooth and problem.line.contact.smooth


def effective_order(problem: Problem, scheme: StepSchemeName) -> float:
    """
    Return the least power of the step with which errors fall.

    A soft contact of a power q that is not an integer causes an error of order q + 1 where the
    bodies touch and part. Graded steps make this error small, but do not change its order.
    """
    order, onset = float(STEP_SCHEMES[scheme].order), problem.line.contact.onset
    if getattr(problem.bond, "damping", 0.0) > 0.0:
        return 1.0  # LAMMPS computes damping forces with the velocities of half a step before
    return order if onset is None else min(order, onset + 1.0)


def largest_step(scheme: StepSchemeName, stiffness: float) -> float:
    """
    Return the largest step that is stable with the chain's fastest mode.

    `stiffness` is U''(1) over the smallest mass.
    """
    if scheme not in COMPOSITIONS:
        return _LARGEST[scheme] / stiffness**0.5
    return _STABILITY_SHARE / (_heaviest(scheme) * stiffness**0.5)


@cache
def _heaviest(scheme: StepSchemeName) -> float:
    return max(abs(weight) for weight in COMPOSITIONS[scheme].weights)


def guess_step(problem: Problem, scheme: StepSchemeName, target_error: float) -> float:
    """Return a guess of the step that reaches a target error."""
    return usual_step(scheme, target_error, problem.fast_stiffness) / frequency_ratio(problem)


def granular_step(problem: Problem, target_error: float) -> float:
    """Return a guess of the Verlet step with which LAMMPS's granular styles reach an error."""
    scale = _GRANULAR_ERROR * problem.fast_stiffness
    usual = (STEP_SHARE * target_error / scale) ** 0.5
    if effective_order(problem, "verlet") < 2.0:
        usual = STEP_SHARE * target_error / (_DAMPED_ERROR * problem.fast_stiffness**0.5)
    return min(largest_step("verlet", problem.fast_stiffness) / 2.0, usual)


def usual_step(scheme: StepSchemeName, target_error: float, stiffness: float) -> float:
    """Return the usual step for a target error with bonds that are hardly compressed."""
    order = _USUAL_ORDERS.get(scheme, STEP_SCHEMES[scheme].order)
    error = _USUAL_SCATTER.get(scheme, 1.0) * _USUAL_ERROR[scheme]
    usual = USUAL_STEPS[scheme] * (target_error / error) ** (1.0 / order)
    return min(largest_step(scheme, stiffness), usual / stiffness**0.5)
