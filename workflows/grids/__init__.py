"""Write grids of LAMMPS jobs, one folder for each point of a sweep, and collect their results."""
