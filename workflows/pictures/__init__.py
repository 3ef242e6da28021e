"""Show a collision as an animation, in the terminal, or on a live page."""
