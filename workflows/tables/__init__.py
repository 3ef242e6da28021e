"""Check bond, angle, dihedral and pair tables for LAMMPS."""
