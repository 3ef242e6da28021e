"""Grids of LAMMPS jobs: a folder for each point of a sweep, and their collected results."""
