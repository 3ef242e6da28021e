"""Another integrator that simply runs on, and what it is asked to judge."""
