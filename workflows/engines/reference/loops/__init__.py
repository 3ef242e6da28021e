"""Compiled loops: their reuse between processes, and the coordination of these processes."""
