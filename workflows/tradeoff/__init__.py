"""Measure the trade-off between speed and accuracy for one collision on this machine."""
