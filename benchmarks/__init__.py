"""Ratios against peers, studies and maps; each runs as ``python -m benchmarks.NAME``."""
