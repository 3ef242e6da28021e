"""Grids of LAMMPS jobs: a folder for each point of a sweep, and what comes back from them."""
