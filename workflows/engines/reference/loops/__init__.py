"""Compiled loops: reuse them between processes, and coordinate these processes."""
