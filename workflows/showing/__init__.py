"""Show results as text, as tables in notebooks, or as pictures."""
