"""MDAnalysis: a dump with its time (dump_modify time yes) is not read. Exit 1: faulty."""

import sys
import warnings
from pathlib import Path

import MDAnalysis

warnings.simplefilter("ignore")
DUMP = """ITEM: TIME
0.5
ITEM: TIMESTEP
100
ITEM: NUMBER OF ATOMS
1
ITEM: BOX BOUNDS ff ff ff
0.0 1.0
0.0 1.0
0.0 1.0
ITEM: ATOMS id type x y z
1 1 0.1234567891234567 0.5 0.5
"""
Path("one.lammpsdump").write_text(DUMP)
try:
    universe = MDAnalysis.Universe(
        "one.lammpsdump", format="LAMMPSDUMP", topology_format="LAMMPSDUMP"
    )
    x = float(universe.atoms.positions[0, 0])
except Exception as error:
    print(f"{type(error).__name__}: {error}")
    sys.exit(1)
print(f"x = 0.1234567891234567 is read as {x!r}, time as {universe.trajectory.ts.time}")
sys.exit(0 if universe.trajectory.ts.time == 0.5 else 1)
