"""Costs of sweeps."""
