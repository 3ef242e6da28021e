"""Many collisions: what is missing, in which order, on which machines."""
