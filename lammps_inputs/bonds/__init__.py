"""Bonds: what a potential is, those that have a name, and a user's own."""
