"""The claims of the paper: each with its place and its number; for margins see `rules`."""
