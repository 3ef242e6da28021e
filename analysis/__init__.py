"""Results to physics: restitution, contacts, modes, theory and figures. Needs no LAMMPS."""
