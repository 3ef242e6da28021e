"""Compare LAMMPS, the reference engine and a user's integrator."""
