"""Comparisons with other programs, and studies; each runs as ``python -m benchmarks.NAME``."""
