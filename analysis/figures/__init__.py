"""Figures, one kind a module; each function takes an axes (or makes one) and returns it."""
