"""Declarations of observables, by subject."""
