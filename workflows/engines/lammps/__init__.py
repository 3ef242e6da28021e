"""The engine that drives LAMMPS through its Python module."""
