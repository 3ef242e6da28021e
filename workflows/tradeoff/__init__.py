"""Measure the trade between speed and accuracy of one collision on this machine."""
