"""Scenes, and the files that LAMMPS reads to run them."""
