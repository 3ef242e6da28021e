"""Columns of beads, compared with a short C++ program and LAMMPS, and the limit of long ones."""
