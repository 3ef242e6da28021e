"""Engine that controls LAMMPS through LAMMPS's own Python module."""
