"""A collision to look at: recorded, in the terminal, behind sliders."""
