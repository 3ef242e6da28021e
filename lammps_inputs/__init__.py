"""A scene, and the files that LAMMPS reads to run it."""
