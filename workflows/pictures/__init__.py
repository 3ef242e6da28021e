"""Moving pictures of a collision: recorded, in the terminal, and on a live page."""
