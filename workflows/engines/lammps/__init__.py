"""Engine that drives LAMMPS through its Python module."""
