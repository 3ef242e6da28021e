"""The engines of our own: stepping, adaptive, modal and hard spheres."""
