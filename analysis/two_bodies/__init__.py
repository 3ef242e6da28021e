"""Dumps of two bodies: a chain and the free target that it hits, or a soft wall."""
