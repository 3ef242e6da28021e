"""ASE: a dump of LAMMPS in units lj is not read. Exit 1: faulty."""

import sys
from pathlib import Path

from ase.io import read

DUMP = """ITEM: TIMESTEP
0
ITEM: NUMBER OF ATOMS
1
ITEM: BOX BOUNDS ff ff ff
0.0 1.0
0.0 1.0
0.0 1.0
ITEM: ATOMS id type x y z vx vy vz
1 1 0.5 0.5 0.5 0.25 0.0 0.0
"""
Path("one.dump").write_text(DUMP)
usual = read("one.dump", format="lammps-dump-text").get_velocities()[0, 0]
print(f"default units: vx = 0.25 is read as {usual:.6g}")
try:
    atoms = read("one.dump", format="lammps-dump-text", units="lj")
except KeyError as error:
    print(f"units='lj': KeyError {error}")
    sys.exit(1)
sys.exit(0 if atoms.get_velocities()[0, 0] == 0.25 else 1)
