"""Data file of the particles for LAMMPS read_data."""

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem

# Free space in the box on both sides of the chain, in chain lengths. It must be sufficient for the
# motion in one collision. The box is not periodic, and LAMMPS never sorts particles anew.
ROOM = 30.0


def format_data(line: Line, bond_types: int = 1, units: UnitSystem = CHAIN_UNITS) -> str:
    """
    Format the data file of a collision, for ``atom_style bond``, exact to the last bit.

    The first ids belong to the chain, molecule 1, and the next ids to a free target, molecule 2.
    Both are counted from the contact outward. Neighbours in a body have bonds of type 1, and the
    file declares `bond_types` types. Each mass has its own atom type. All values are in `units`.
    """
    positions, velocities = initial_state(line)
    masses = np.concatenate((line.chain_masses, line.target_masses))
    count, n = len(masses), len(line.chain_masses)
    values, types = np.unique(masses, return_inverse=True)
    reach = ROOM * (count + 10.0) * (1.0 if line.is_standard else _slowness(masses, velocities))
    reach, half = units.length * reach, 0.5 * units.length
    positions, velocities = units.length * positions, units.speed * velocities
    values = units.mass * values
    first_ids = [*range(1, n), *range(n + 1, count)]
    lines = [
        "chain of particles, particle 1 nearest the wall at x = 0",
        "",
        f"{count} atoms",
        f"{len(first_ids)} bonds",
        f"{len(values)} atom types",
        f"{bond_types} bond types",
        "",
        f"{-reach:.17g} {reach:.17g} xlo xhi",
        f"{-half:.17g} {half:.17g} ylo yhi",
        f"{-half:.17g} {half:.17g} zlo zhi",
        "",
        "Masses",
        "",
    ]
    lines += [f"{kind} {mass!r}" for kind, mass in enumerate(values.tolist(), 1)]
    lines += ["", "Atoms # bond", ""]
    rows = zip(types.ravel().tolist(), positions.tolist(), strict=True)
    lines += [
        f"{i} {1 if i <= n else 2} {kind + 1} {x:.17g} 0 0" for i, (kind, x) in enumerate(rows, 1)
    ]
    lines += ["", "Velocities", ""]
    lines += [f"{i} {v:.17g} 0 0" for i, v in enumerate(velocities.tolist(), 1)]
    if first_ids:
        lines += ["", "Bonds", ""]
        lines += [f"{k} 1 {i} {i + 1}" for k, i in enumerate(first_ids, 1)]
    return "\n".join(lines) + "\n"


def _slowness(masses: Array, velocities: Array) -> float:
    """Return the factor that enlarges the box for bodies that separate slowly or move fast."""
    slow = max(1.0, float(np.mean(masses)) ** 0.5)
    return slow * max(1.0, 2.0 * float(np.max(np.abs(velocities))))


def initial_state(line: Line) -> tuple[Array, Array]:
    """
    Return initial positions and velocities of both bodies, first those of the chain.

    The first particle of the target is at x = 0, and the others at -1, -2, ... Particle 1 of the
    chain also has x = 0 when the surfaces of both bodies touch. A chain without internal motion
    starts at its first contact, because its flight needs no computation. Other chains start at the
    initial gap of `line`.
    """
    lengths = 1.0 + line.strains[line.first :]
    gap = 0.0 if _rests(line) else float(line.strains[line.gap])
    chain = np.cumsum(np.concatenate(([gap], lengths)))
    velocities = line.velocities[line.first :]
    if line.rigid:
        return chain, velocities
    behind = 1.0 + line.strains[: line.gap][::-1]
    target = -np.cumsum(np.concatenate(([0.0], behind)))
    return (
        np.concatenate((chain, target + 0.0)),
        np.concatenate((velocities, line.velocities[: line.first][::-1])),
    )


def _rests(line: Line) -> bool:
    """Return whether both bodies have no internal motion before their first contact."""
    bonds = np.delete(line.strains, line.gap)
    chain, target = line.velocities[line.first :], line.velocities[: line.first]
    return not (np.any(bonds) or np.ptp(chain) > 0.0 or np.ptp(target) > 0.0)
