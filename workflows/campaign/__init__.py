"""Carry out many collisions: tasks, workers, and stores for the results."""
