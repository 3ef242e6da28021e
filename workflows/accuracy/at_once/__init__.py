"""Tolerances for many collisions at once."""
