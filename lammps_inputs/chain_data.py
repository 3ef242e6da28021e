"""The chain's data file, as LAMMPS read_data reads it."""

import numpy as np
from numpy.typing import NDArray

# Free space on both sides of the chain, in chain lengths. The box only has to hold the motion of
# one collision; nothing is periodic and nothing is ever re-sorted.
_ROOM = 30.0


def format_chain_data(
    positions: NDArray[np.float64], velocities: NDArray[np.float64], bond_types: int = 1
) -> str:
    """
    Format a chain for ``atom_style bond``, exact to the last bit.

    Positions and velocities are along x, away from the wall at x = 0, particle 1 first. The file
    has ids 1..n in one molecule, mass 1 and bonds of type 1, with room for `bond_types`.
    """
    n = len(positions)
    reach = _ROOM * (n + 10.0)
    lines = [
        "chain of particles, particle 1 nearest the wall at x = 0",
        "",
        f"{n} atoms",
        f"{n - 1} bonds",
        "1 atom types",
        f"{bond_types} bond types",
        "",
        f"{-reach:.17g} {reach:.17g} xlo xhi",
        "-0.5 0.5 ylo yhi",
        "-0.5 0.5 zlo zhi",
        "",
        "Masses",
        "",
        "1 1.0",
        "",
        "Atoms # bond",
        "",
    ]
    lines += [f"{i} 1 1 {x:.17g} 0 0" for i, x in enumerate(positions.tolist(), 1)]
    lines += ["", "Velocities", ""]
    lines += [f"{i} {v:.17g} 0 0" for i, v in enumerate(velocities.tolist(), 1)]
    if n > 1:
        lines += ["", "Bonds", ""]
        lines += [f"{i} 1 {i} {i + 1}" for i in range(1, n)]
    return "\n".join(lines) + "\n"


def initial_chain(
    particles: int, impact_velocity: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """
    Return the chain at its first contact: a chain in flight has nothing to compute.

    Positions are x_i = i - 1, velocities -v0: particle 1 is at the wall, about to be reversed.
    """
    return np.arange(particles, dtype=float), np.full(particles, -impact_velocity)
