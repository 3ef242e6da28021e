"""Execution of many collisions: tasks, workers, and the place of their results."""
