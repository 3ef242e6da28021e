"""Guess the step with which the reference engine reaches a target error, without a run."""

import math
from collections.abc import Iterable

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.schemes import SCHEMES, StepSchemeName
from chaincor.workflows.measured import measured

# A step is chosen such that its error is this fraction of the target error, because the error bar
# has other parts. The fraction affects only the cost.
STEP_SHARE = 0.5
# Error of eta at the usual step of each scheme, for chains of about 100 particles. A bond that is
# compressed to a curvature k needs steps that are shorter by sqrt(k). Only the first guess depends
# on these values.
_USUAL_ERROR: dict[str, float] = measured("usual_error")
# Error of eta with LAMMPS's granular styles, divided by the square of the step; the unit of the
# step is 1/frequency. The measured ratio is 0.03 for columns of 10 beads and 0.06 for columns of
# 100 beads.
_GRANULAR_ERROR = 0.06
# With damping, the error of eta is divided by the step itself; the measured ratio is 0.001 to 0.1.
# The refinement finds a shorter step if necessary.
_DAMPED_ERROR = 0.01


def frequency_ratio(problem: Problem) -> float:
    """
    Return the ratio of the highest frequency to the frequency of an uncompressed bond.

    For bonds, the ratio is sqrt(U''(shortest)/U''(1)), at least 1, with a guess of the shortest
    bond length. A soft contact may have a higher frequency.
    """
    line, bond = problem.line, problem.bond
    if bond.only_pushes:
        return 1.0  # the stiffness of beads is computed for the speed of the scene
    sharpest = 1.0
    if line.heaviest_pair > 0.0:
        energy = pair_energy(line)
        # A user's bond object may not be hashable, and is therefore not cached.
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
    """Compute and cache the frequency ratios of many problems together, in a tenth of the time."""
    energies: dict[Potential, set[float]] = {}
    for problem in problems:
        if problem.named and problem.line.heaviest_pair > 0.0:
            energies.setdefault(problem.bond, set()).add(pair_energy(problem.line))
    for bond, asked in energies.items():
        if new := [energy for energy in asked if (bond, energy) not in _compressed]:
            _keep_compressed(bond, new)


def pair_energy(line: Line) -> float:
    """Return the energy of a bond whose two particles collide at the relative velocity 2 v0."""
    return 2.0 * line.heaviest_pair * (line.largest_speed * line.largest_speed)


# For a bond and an energy, the cache contains the strain at which the compressed bond has this
# energy, and U'' at this strain. In a sweep, many chains of different lengths have the same speeds.
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


def effective_order(problem: Problem, scheme: StepSchemeName) -> float:
    """
    Return the lowest order with which errors fall as the step decreases.

    If the force of a soft contact is a power q that is not an integer, the steps at which the
    bodies touch and part cause an error of order q + 1. Graded steps make this error small, but do
    not change its order.
    """
    order, onset = float(SCHEMES[scheme].order), problem.line.contact.onset
    if getattr(problem.bond, "damping", 0.0) > 0.0:
        return 1.0  # LAMMPS computes damping forces with velocities from half a step earlier
    return order if onset is None else min(order, onset + 1.0)


def largest_step(scheme: StepSchemeName, stiffness: float) -> float:
    """
    Return the largest step that is stable for the fastest mode of the chain.

    `stiffness` is U''(1) divided by the smallest mass.
    """
    return SCHEMES[scheme].largest_step(stiffness**0.5)


def guess_step(problem: Problem, scheme: StepSchemeName, target_error: float) -> float:
    """Return a guess of the time step that reaches a target error."""
    return usual_step(scheme, target_error, problem.fast_stiffness) / frequency_ratio(problem)


def granular_step(problem: Problem, target_error: float) -> float:
    """Return a guess of the Verlet step for a target error with LAMMPS's granular styles."""
    scale = _GRANULAR_ERROR * problem.fast_stiffness
    usual = (STEP_SHARE * target_error / scale) ** 0.5
    if effective_order(problem, "verlet") < 2.0:
        usual = STEP_SHARE * target_error / (_DAMPED_ERROR * problem.fast_stiffness**0.5)
    return min(largest_step("verlet", problem.fast_stiffness) / 2.0, usual)


def usual_step(scheme: StepSchemeName, target_error: float, stiffness: float) -> float:
    """Return the usual step for a target error if bonds are hardly compressed."""
    facts = SCHEMES[scheme]
    error = facts.usual_scatter * _USUAL_ERROR[scheme]
    usual = facts.usual_step * (target_error / error) ** (1.0 / (facts.usual_order or facts.order))
    return min(largest_step(scheme, stiffness), usual / stiffness**0.5)
