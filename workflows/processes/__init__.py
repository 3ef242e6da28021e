"""Collisions handed to other processes, and how far they are."""
