"""Check of bond, angle, dihedral and pair tables of any LAMMPS user."""
