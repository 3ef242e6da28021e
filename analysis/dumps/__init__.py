"""Dumps of LAMMPS, read frame by frame."""
