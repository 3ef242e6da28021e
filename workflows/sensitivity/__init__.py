"""Compute the derivatives of eta from the linearised motion of a collision."""
