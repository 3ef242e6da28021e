"""States of a chain for other programs: ASE, and extended XYZ for OVITO and ``ase gui``."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.atomic_write import written_aside
from chaincor.analysis.dumps.chain_frames import ChainLayout
from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.frame import DumpFrames
from chaincor.analysis.dumps.masses import masses_of_bodies
from chaincor.analysis.dumps.other_trajectories import open_trajectory
from chaincor.lammps_inputs.arrays import Array

if TYPE_CHECKING:
    from ase import Atoms

    from chaincor.lammps_inputs.bonds.potential import Potential

# Viewers need a chemical element. A Lennard-Jones chain would be made of argon.
SYMBOL = "Ar"


def read_states(dump: Path | str | DumpFrames, timestep: float = 1.0) -> Iterator[ChainState]:
    """
    Yield the state in each frame of a dump.

    Parameters
    ----------
    dump : pathlib.Path, str or Frames
        A file that :func:`~chaincor.analysis.dumps.other_trajectories.open_trajectory` can open, or
        an open trajectory, in the units of the chain.
    timestep : float
        Simulated time per step, for dumps that do not carry the time.
    """
    source = _opened(dump)
    return ChainLayout.from_frame(source.first()).states(source, timestep)


def to_ase(
    dump: Path | str | DumpFrames, timestep: float = 1.0, masses: ArrayLike | None = None
) -> "Iterator[Atoms]":
    """
    Yield each frame of a dump as the ASE Atoms that :func:`ase_atoms` makes.

    Positions and velocities are not converted. ASE's own reader does not know ``units lj`` and
    rescales velocities. For `dump` and `timestep` see :func:`read_states`. `masses` are in order
    from the wall outwards, and are repeated along the chain. By default they come from the dump, or
    are 1. Raises InputError if particles have different types and their masses are unknown.
    """
    source = _opened(dump)
    layout, m = _layout_and_masses(source, masses)
    for state in layout.states(source, timestep):
        yield ase_atoms(state, m)


def ase_atoms(state: ChainState, masses: Array, bond: "Potential | None" = None) -> "Atoms":
    r"""
    Return the state of a chain as ASE Atoms, in reduced units and float64.

    The particles of a free target follow the particles of the chain. The Atoms have positions (x,
    0, 0), no cell and no periodic direction. The array ``displacement`` contains the displacement
    of each atom, and the array ``bonds`` its neighbours, in the format that ASE uses for LAMMPS
    data files. ``info`` contains ``time`` and ``step``. If a bond is given, the Atoms also have the
    potential energy :math:`\sum_i U(s_i)` and the forces of the bonds, without the contact force.
    """
    from ase import Atoms

    x = state.all_positions
    atoms = Atoms([SYMBOL] * x.size, positions=_along_x(x))
    atoms.set_masses(masses)
    atoms.set_velocities(_along_x(state.all_velocities))
    atoms.new_array("displacement", state.all_displacements)
    neighbours = {i: f"{j}(1)" for i, j in state.all_bonds}
    atoms.new_array("bonds", np.array([neighbours.get(i, "_") for i in range(x.size)]))
    atoms.info.update(time=state.time, step=state.step)
    if bond is not None:
        from ase.calculators.singlepoint import SinglePointCalculator

        energy, forces = 0.0, []
        for body, along in zip(state.bodies, (1.0, -1.0), strict=False):  # the target is mirrored
            strains = np.diff(body.displacements)
            pushes = np.asarray(bond.force(strains), dtype=float)
            energy += float(np.sum(bond.energy(strains)))
            forces.append(-along * np.diff(pushes, prepend=0.0, append=0.0))
        vectors = _along_x(np.concatenate(forces))
        atoms.calc = SinglePointCalculator(atoms, energy=energy, forces=vectors)
    return atoms


def write_extended_xyz(
    dump: Path | str | DumpFrames,
    path: Path | str,
    timestep: float = 1.0,
    masses: ArrayLike | None = None,
    target_masses: Array | None = None,
) -> int:
    """
    Write a dump as extended XYZ with all digits, and return the number of frames.

    The file appears only when it is complete. For `dump`, `timestep` and `masses` see
    :func:`to_ase`. `target_masses`, of shape (M,), are the masses of a free target from the contact
    outward. Particles of the target follow those of the chain.
    """
    source, count = _opened(dump), 0
    if target_masses is None:
        layout, m = _layout_and_masses(source, masses)
    else:
        layout = ChainLayout.from_frame(source.first(), target_masses.size)
        m = np.concatenate((np.asarray(masses), target_masses))
    states, listed = layout.states(source, timestep), m.tolist()
    with written_aside(Path(path), "xyz") as aside, aside.open("w", encoding="ascii") as file:
        for state in states:
            file.write(
                f"{m.size}\nProperties=species:S:1:pos:R:3:velo:R:3:displacement:R:1:masses:R:1 "
                f'pbc="F F F" Time={state.time!r} Step={state.step}\n'
            )
            columns = state.all_positions, state.all_velocities, state.all_displacements
            rows = zip(*(column.tolist() for column in columns), listed, strict=True)
            file.writelines(
                f"{SYMBOL} {a!r} 0.0 0.0 {b!r} 0.0 0.0 {c!r} {d!r}\n" for a, b, c, d in rows
            )
            count += 1
    return count


def _opened(dump: Path | str | DumpFrames) -> DumpFrames:
    return open_trajectory(dump) if isinstance(dump, Path | str) else dump


def _layout_and_masses(source: DumpFrames, given: ArrayLike | None) -> tuple[ChainLayout, Array]:
    first = source.first()
    layout = ChainLayout.from_frame(first)
    return layout, masses_of_bodies(first, layout, given=given)[0][0]


def _along_x(values: np.ndarray) -> np.ndarray:
    vectors = np.zeros((values.size, 3))
    vectors[:, 0] = values
    return vectors
