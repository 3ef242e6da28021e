"""Numerics and error bars for a tolerance."""
