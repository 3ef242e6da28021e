"""Where particles are, in pictures of a chain and of the free target that it hits."""

import numpy as np

from chaincor.lammps_inputs.arrays import Array


def rest_positions(particles: int, targets: int = 0) -> Array:
    """
    Return where particles are at rest, in natural bond lengths.

    Particle 1 of the chain is at 0; the first `targets` are a free target's, from its far end to
    the contact, which is at 0, too.
    """
    chain = np.arange(float(particles - targets))
    return np.concatenate((np.arange(1.0 - targets, 1.0), chain)) if targets else chain
