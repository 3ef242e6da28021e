"""Many collisions: what is to be done, by which workers, and who takes the results."""
