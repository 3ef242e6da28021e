"""How a number changes along a ladder of ever finer steps: its order, its limit, its scatter."""
