"""Figures of the paper and beyond it: one module for each figure, with its claims."""
