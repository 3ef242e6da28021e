"""Proof that beads which only push never touch their target again, from one state."""

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.line import Line


def bodies_part(line: Line, potential: float, gap: float, velocities: Array) -> bool:
    """
    Return whether the bodies, which are `gap` apart, are proved to have parted for ever.

    `velocities` are those along x, of shape (N,), and `potential` is at least the energy of all
    overlaps within bodies. The proof is that of :mod:`.reference.bead_loops`: no bead leaves
    velocities w that rise along x by more than the energy of the motion relative to w allows.
    """
    if gap < 0.0:
        return False
    first = 1 if line.rigid else 0
    v, masses = velocities[first:], line.masses[first:]
    low = np.minimum.accumulate(v[::-1])[::-1]
    high = np.maximum.accumulate(v)
    if line.rigid:  # the wall stays
        low, high = np.maximum(low, 0.0), np.maximum(high, 0.0)
    rising = 0.5 * (low + high)
    energy = 0.5 * float(masses @ (v - rising) ** 2) + potential
    faster = np.sqrt(2.0 * energy * line.inverse_masses[[line.gap, line.first]]).sum()
    before = 0.0 if line.rigid else rising[line.gap]
    return bool(rising[line.first - first] - before > faster)
