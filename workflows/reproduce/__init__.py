"""The paper, recomputed: plan, measurements, findings, verdicts, figures and the report."""
