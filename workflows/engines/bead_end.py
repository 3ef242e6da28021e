"""Prove from one state that a column of beads never touches its target again."""

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.line import Line


def bodies_part(line: Line, potential: float, gap: float, velocities: Array) -> bool:
    """
    Return whether it is proved that two bodies at a distance `gap` never touch again.

    `velocities` are along x, of shape (N,). `potential` is an upper bound on the energy of all
    overlaps within the bodies. The docstring of :mod:`.reference.bead_loops` has the proof, which
    compares the velocities of the beads with velocities w that rise along x. The energy limits the
    differences between both sets of velocities.
    """
    if gap < 0.0:
        return False
    first = 1 if line.rigid else 0
    v, masses = velocities[first:], line.masses[first:]
    low = np.minimum.accumulate(v[::-1])[::-1]
    high = np.maximum.accumulate(v)
    if line.rigid:  # a rigid wall does not move
        low, high = np.maximum(low, 0.0), np.maximum(high, 0.0)
    rising = 0.5 * (low + high)
    energy = 0.5 * float(masses @ (v - rising) ** 2) + potential
    faster = np.sqrt(2.0 * energy * line.inverse_masses[[line.gap, line.first]]).sum()
    before = 0.0 if line.rigid else rising[line.gap]
    return bool(rising[line.first - first] - before > faster)
