"""A collision to look at: recorded, in the terminal, on a live page."""
