"""Analysis of a number along a ladder of ever finer steps: its order, limit and scatter."""
