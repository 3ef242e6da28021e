"""Run a user's LAMMPS script at several values of a setting, and advise a value."""
