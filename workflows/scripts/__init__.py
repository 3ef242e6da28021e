"""Study a user's LAMMPS script to find a value of a setting that is fine enough."""
