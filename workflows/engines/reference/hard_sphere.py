r"""
Compute collisions in the limit of high speed, in which bonds act like hard spheres.

If the impact is so fast that the cohesion of the bonds does not matter, two neighbours that collide
exchange their velocities. Every particle then moves with the velocity -v0 or v0. The velocities
move through the chain as if the particles passed through each other. After n(n - 1)/2 exchanges and
n contacts with the wall, every particle leaves with the velocity v0 and all bonds have their
natural length. The restitution is therefore exactly 1.

The diameter d of the spheres is the length at which a bond stops two particles that collide with
velocities v0 and -v0. The energy of their relative motion is v0^2; therefore :math:`U(d) = v_0^2`.
The diameter affects only the contact times k (1 - d)/v0.

The true restitution differs from 1 because of encounters between three particles at once. The
difference 1 - eta falls with a power of the speed that depends on the bond. For n = 20, the
measured power is 3.1 at 8 v* and 4.5 at 64 v* for lj bonds, 3.0 and 3.5 for toda bonds, and 9 to 11
for log bonds; see `deviation`.
"""

import math
from dataclasses import replace

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference.finish import (
    End,
    LastContact,
    finish,
    run_single_particle,
)
from chaincor.workflows.errors import CrossingError, TimestepError
from chaincor.workflows.measured import measured

SCHEME = "hard-sphere"

# Three particles are run with the target error _TRIPLE_ACCURACY. Their vibration energy, as a
# fraction of the total energy, is known down to _LEAST_LOSS.
_TRIPLE_ACCURACY = 1e-12
_LEAST_LOSS = 1e-22
# Three particles are run at speeds up to this limit, in units of v*. At higher speeds the loss is
# below _LEAST_LOSS, and the slow vibration after the particles have separated consists of rounding
# errors, which no step can follow.
_FASTEST_TRIPLE = 1e6
# The speed of three particles is halved at most this many times, until a run succeeds. Twenty
# halvings of the highest speed already reach v*, at which a run succeeds for every bond that has a
# v*.
_MOST_HALVINGS = 40
# For all measured bonds, the loss falls at least as fast as 1/speed to this power.
_LEAST_POWER: float = measured("sphere_power")


def run(problem: Problem) -> Outcome:
    """
    Return the outcome of a collision in the limit of high speed; its restitution is 1.

    Raises CrossingError if the bond cannot stop two particles that collide at this speed.
    """
    particles, speed = problem.particles, problem.impact_velocity
    if particles == 1:
        return run_single_particle(problem, SCHEME, None, None)
    diameter = stopping_length(problem.bond, speed)
    times = np.linspace(0.0, (particles - 1) * (1.0 - diameter) / speed, particles)
    strains, velocities = np.zeros(particles - 1), np.full(particles, speed)
    return finish(
        problem,
        LastContact(
            strains, velocities, times, np.full(particles, speed), bond_range=(diameter, 1.0)
        ),
        End(Ending("proved"), float(times[-1]), 0),
        scheme=SCHEME,
        timestep=None,
        seconds=0.0,
    )


def deviation(problem: Problem) -> float:
    """
    Return an estimated bound on 1 - eta for the bonds of a scene.

    A chain of two particles keeps its translational energy exactly; a chain of three is the
    smallest that loses some. A chain of n particles has (n - 1)(n - 2)/2 encounters between three
    particles. The bound is this count times the loss of three particles at the same speed. In all
    comparisons with the adaptive engine (n = 4 to 50, lj, toda, log, at 3 to 100 v*), the bound
    exceeded the true loss by a factor of 1 to 10, and by a larger factor in longer chains. The
    bound is a measured rule, not a theorem.

    The rule is valid if the loss falls with the speed at least as fast as for these bonds. The loss
    is therefore also computed at half the speed. The result is inf if the loss falls more slowly,
    for example for bonds whose force is a power of the strain. The loss is computed from the
    vibration energy of the three particles, because it is far below the rounding error of eta. At
    some speeds, no step resolves the motion of three particles. At these speeds, the loss of bonds
    that are known to become hard is extrapolated as a power law with the smallest measured
    exponent. The result for other bonds is inf. Raises TimestepError if bonds become hard but no
    speed can be resolved.
    """
    particles, bond = problem.particles, problem.bond
    if particles < 3:
        return 0.0
    velocity, halvings = problem.impact_velocity, 0
    if bond.becomes_hard:
        assert bond.natural_speed is not None
        velocity, halvings = min(velocity, _FASTEST_TRIPLE * bond.natural_speed), _MOST_HALVINGS
    triple = replace(Problem.of_cold_chain(bond, 3, velocity), label=problem.label)
    loss = vibration_share(triple)
    for _ in range(halvings):
        if loss is not None:
            break
        triple = triple.at_velocity(0.5 * triple.impact_velocity)
        loss = vibration_share(triple)
    if loss is None:
        if not bond.becomes_hard:
            return math.inf
        raise TimestepError(
            f"no step resolves three particles with {problem.label} bonds, at velocity "
            f"{velocity:.6g} or down to {triple.impact_velocity:.2g}, so the distance of "
            "the chain to hard spheres is unknown. Check that the bond softens as it is "
            "less compressed, or lower the speed"
        )
    slower = vibration_share(triple.at_velocity(0.5 * triple.impact_velocity))
    if slower is None or max(loss, _LEAST_LOSS) > max(0.5**_LEAST_POWER * slower, _LEAST_LOSS):
        return math.inf
    loss *= (triple.impact_velocity / problem.impact_velocity) ** _LEAST_POWER
    return 0.5 * (particles - 1) * (particles - 2) * max(loss, _LEAST_LOSS)


def vibration_share(problem: Problem) -> float | None:
    """
    Return the fraction of vibration in the energy of three particles after their collision.

    Return None if no step resolves the bonds, because they get too short.
    """
    from chaincor.workflows.engines.reference import adaptive

    try:
        end = adaptive.run(problem, _TRIPLE_ACCURACY)
    except TimestepError:
        return None
    about_mean = end.velocities - float(np.mean(end.velocities))
    stored = float(np.sum(problem.bond.energy(np.diff(end.displacements))))
    return (0.5 * float(about_mean @ about_mean) + stored) / end.energy_start


def stopping_length(bond: Potential, speed: float) -> float:
    """
    Return the length d at which a bond stops two particles of velocity +-v0: U(d) = v0^2.

    The result is zero if the length is below the rounding error of a strain. Raises CrossingError
    if U(0) is too low.
    """
    from scipy.optimize import brentq

    def excess(strain: float) -> float:
        return float(bond.energy(np.array(strain))) - speed**2

    shortest = math.nextafter(-1.0, 0.0)
    if excess(shortest) <= 0.0:
        if bond.strain_min == -1.0:
            return 0.0
        raise CrossingError(
            f"a {bond.name} bond cannot stop two particles that collide at velocity "
            f"{speed:.6g}. Lower the speed"
        )
    return 1.0 + float(brentq(excess, shortest, 0.0, xtol=1e-300, rtol=1e-15))
