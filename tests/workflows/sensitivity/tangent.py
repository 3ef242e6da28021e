"""Integrate a small change of a state in NumPy, as a reference for the loops of derivatives."""

import numpy as np

from chaincor.workflows.engines.reference.compile import scalar_force
from chaincor.workflows.sensitivity.loops import differences_of


def changed(traced, bond, strain, velocity):
    """
    Return the change of the state after the last contact from a small initial change.

    The changes are along x and include the gap. The final change compares states just after the
    last contact, which have different times.
    """
    strain, velocity, line = strain.copy(), velocity.copy(), traced.line
    force = scalar_force(bond)
    bend = np.vectorize(bond.curvature_kernel or differences_of(force.function), excluded=[1])
    p, inverse = line.gap, line.inverse_masses
    for stretch in traced.stretches:
        tape, last_strain, last_velocity = traced.follow(stretch)
        times, hits, drifts, kicks = stretch.substeps
        for n, time in enumerate(times):
            for k, kick in enumerate(kicks):
                strain += drifts[k] * time * np.diff(velocity)
                at = tape.strains[n, k]
                stiffness = bend(at, force.parameters)
                stiffness[p] = line.contact.curvature(at[p])
                pushes = np.concatenate(([0.0], -stiffness * strain, [0.0]))
                velocity -= kick * time * inverse * np.diff(pushes)
            strain += drifts[-1] * time * np.diff(velocity)
            if hits[n] == 1.0:
                jump(strain, velocity, tape.impacts[n], p, inverse)
    rates = np.diff(last_velocity)
    delay = -strain[p] / rates[p]
    return strain + rates * delay, velocity + traced.accelerations(last_strain) * delay


def jump(strain, velocity, impact, p, inverse):
    """Propagate a change through an impact, whose time depends on the change."""
    speed, before, after = impact
    delay = strain[p] / speed
    share = 2.0 / (inverse[p] + inverse[p + 1])
    given = share * (velocity[p] - velocity[p + 1] + (before - after) * delay)
    if p > 0:
        strain[p - 1] += share * speed * inverse[p] * delay
    if p + 1 < len(strain):
        strain[p + 1] += share * speed * inverse[p + 1] * delay
    strain[p] = -strain[p]
    velocity[p] -= given * inverse[p]
    velocity[p + 1] += given * inverse[p + 1]
