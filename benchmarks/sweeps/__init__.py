"""Costs of sweeps, and results after a sweep is killed."""
