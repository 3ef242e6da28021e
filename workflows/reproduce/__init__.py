"""Recompute the paper's results, judge its claims, and write a report with figures."""
