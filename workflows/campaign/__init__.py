"""Carry out many collisions: divide them into tasks for workers, and store the results."""
