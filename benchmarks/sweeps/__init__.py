"""Time of sweeps."""
