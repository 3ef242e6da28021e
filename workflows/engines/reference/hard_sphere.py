r"""
The limit of high speed: bonds that act like hard spheres.

Where the impact is so fast that the cohesion of the bonds does not matter, two neighbours that
meet exchange velocities. All particles then carry one of the two velocities -v0 and v0, and each
exchange hands on the one for the other, as if the particles passed through each other: after
n(n - 1)/2 exchanges and n contacts with the wall every particle leaves with v0 and at its natural
place, so that the restitution is exactly 1.

The spheres' diameter d is the length at which a bond stops two particles that meet with velocities
v0 and -v0, whose energy of relative motion is v0^2: :math:`U(d) = v_0^2`. It decides the times of
the contacts, k (1 - d)/v0, and nothing else.

How far the restitution of the bonds themselves is from 1 is decided where three particles are in
touch at once. It falls with a power of the speed that depends on the bond: measured for n = 20, 3.1
at 8 v* and 4.5 at 64 v* for lj, 3.0 and 3.5 for toda, 9 to 11 for log; see `deviation`.
"""

import math

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.scene import Scene
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

# Accuracy of the triple's velocities, and the floor that it leaves to the energy of its vibration.
_TRIPLE_ACCURACY = 1e-12
_LEAST_LOSS = 1e-22
# In units of v*. Beyond it the loss is below that floor, and the slow vibration of a triple that
# has flown apart is rounding, after which no step follows.
_FASTEST_TRIPLE = 1e6
# From there twenty reach v*, where a triple of any bond with a v* is soft.
_MOST_HALVINGS = 40
# The loss falls with at least this power of the speed, for all bonds that were measured.
_LEAST_POWER: float = measured("sphere_power")


def run(scene: Scene) -> Outcome:
    """
    Return the outcome of a collision in the limit of high speed, with a restitution of 1.

    Raises CrossingError if the bond cannot stop two particles that meet at this speed.
    """
    particles, speed = scene.particles, scene.impact_velocity
    if particles == 1:
        return run_single_particle(scene, SCHEME, None, None)
    diameter = stopping_length(scene.bond, speed)
    times = np.linspace(0.0, (particles - 1) * (1.0 - diameter) / speed, particles)
    strains, velocities = np.zeros(particles - 1), np.full(particles, speed)
    return finish(
        scene,
        LastContact(
            strains, velocities, times, np.full(particles, speed), bond_range=(diameter, 1.0)
        ),
        End(Ending("proved"), float(times[-1]), 0),
        scheme=SCHEME,
        timestep=None,
        seconds=0.0,
    )


def deviation(scene: Scene) -> float:
    """
    Estimate how far the restitution of the bonds is from that of hard spheres, a bound of 1 - eta.

    A pair keeps its energy exactly and a triple is the smallest chain that does not. A chain of n
    has (n - 1)(n - 2)/2 encounters of three, and so many times the loss of a triple at the same
    speed was an upper bound wherever it was compared with the adaptive engine (n = 4 to 50, lj,
    toda, log, at 3 to 100 v*), by a factor of 1 to 10, and more in longer chains. It is a measured
    rule, not a theorem.

    The rule holds where the loss falls with the speed as it does for those bonds. So the loss is
    measured at the speed asked for and at half of it, and inf is returned where it falls less: a
    bond that stiffens like a power of the strain keeps its loss at any speed. The loss is taken
    from the energy of the triple's vibration, which is far below the rounding of eta itself. Only
    for bonds that are known to become hard is it extrapolated, by the slowest fall that was
    measured, to speeds at which the triple cannot be followed; others have inf there. Raises
    TimestepError if a triple of bonds that become hard cannot be followed at any speed.
    """
    particles, bond = scene.particles, scene.bond
    if particles < 3:
        return 0.0
    velocity, halvings = scene.impact_velocity, 0
    if bond.becomes_hard:
        assert bond.natural_speed is not None
        velocity, halvings = min(velocity, _FASTEST_TRIPLE * bond.natural_speed), _MOST_HALVINGS
    triple = scene.replace(particles=3, speed=None, velocity=velocity)
    loss = vibration(triple)
    for _ in range(halvings):
        if loss is not None:
            break
        triple = triple.replace(velocity=0.5 * triple.impact_velocity)
        loss = vibration(triple)
    if loss is None:
        if not bond.becomes_hard:
            return math.inf
        raise TimestepError(
            f"no step resolves three particles with {scene.label} bonds, at velocity "
            f"{velocity:.6g} or down to {triple.impact_velocity:.2g}, so the "
            "distance of the chain to hard spheres is unknown; expected bonds that get softer as "
            "they are less compressed: check the potential, or lower the speed"
        )
    slower = vibration(triple.replace(velocity=0.5 * triple.impact_velocity))
    if slower is None or max(loss, _LEAST_LOSS) > max(0.5**_LEAST_POWER * slower, _LEAST_LOSS):
        return math.inf
    loss *= (triple.impact_velocity / scene.impact_velocity) ** _LEAST_POWER
    return 0.5 * (particles - 1) * (particles - 2) * max(loss, _LEAST_LOSS)


def vibration(scene: Scene) -> float | None:
    """
    Return the energy of the vibration of three particles after their collision over all before.

    None where the bonds are too short to be stepped.
    """
    from chaincor.workflows.engines.reference import adaptive

    try:
        end = adaptive.run(scene, _TRIPLE_ACCURACY)
    except TimestepError:
        return None
    about_mean = end.velocities - float(np.mean(end.velocities))
    stored = float(np.sum(scene.bond.energy(np.diff(end.displacements))))
    return (0.5 * float(about_mean @ about_mean) + stored) / end.energy_start


def stopping_length(bond: Potential, speed: float) -> float:
    """
    Return the length d at which a bond stops two particles that meet with +-v0: U(d) = v0^2.

    Zero where it is below the rounding of a strain. Raises CrossingError if U(0) is too low.
    """
    from scipy.optimize import brentq

    def excess(strain: float) -> float:
        return float(bond.energy(np.array(strain))) - speed**2

    shortest = math.nextafter(-1.0, 0.0)
    if excess(shortest) <= 0.0:
        if bond.strain_min == -1.0:
            return 0.0
        raise CrossingError(
            f"a {bond.name} bond cannot stop two particles that meet at velocity {speed:.6g}; "
            "expected a bond that keeps them apart: lower the speed"
        )
    return 1.0 + float(brentq(excess, shortest, 0.0, xtol=1e-300, rtol=1e-15))
