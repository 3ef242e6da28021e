"""Comparison of LAMMPS, the reference engine and a user's integrator."""
