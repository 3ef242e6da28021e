"""Tolerance in, numerics and error bar out."""
