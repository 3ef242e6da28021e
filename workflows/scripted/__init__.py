"""Scripts that LAMMPS runs alone: what is chosen for them, and what is made of many."""
