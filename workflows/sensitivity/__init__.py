"""Compute derivatives of a collision from its linearised motion, forward and backward."""
