"""Analysis of a quantity along a ladder of ever finer steps: its order, limit and scatter."""
