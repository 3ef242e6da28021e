"""Recompute the paper: plan, measurements, findings, verdicts, figures and the report."""
