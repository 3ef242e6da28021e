"""Collisions of many chains with a hard wall in one compiled loop."""
