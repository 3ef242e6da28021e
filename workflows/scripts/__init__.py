"""The trade-off of a LAMMPS script of the user's own: which value of a variable is fine enough."""
