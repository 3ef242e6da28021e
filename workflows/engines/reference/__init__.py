"""Reference engines: stepping, adaptive, modal and hard spheres."""
