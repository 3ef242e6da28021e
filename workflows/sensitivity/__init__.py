"""Derivatives of a collision: its linearised motion, forward and backward."""
