"""Columns of beads beside a page of C++ and LAMMPS's granular styles, and their limits."""
