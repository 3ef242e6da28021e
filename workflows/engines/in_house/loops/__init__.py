"""Loops that are compiled, and how compiled ones are kept."""
