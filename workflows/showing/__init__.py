"""Show a result as lines of text, as a table in a notebook, or as pictures."""
