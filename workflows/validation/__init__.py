"""LAMMPS, the in-house integrator and a user's own, held against each other."""
