"""Study of a user's LAMMPS script: which value of a variable is fine enough."""
