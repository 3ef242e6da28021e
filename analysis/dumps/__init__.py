"""Readers of LAMMPS dumps, frame by frame."""
