"""Tables of bonds, angles and pairs, of any LAMMPS user: whether they are good, and how good."""
