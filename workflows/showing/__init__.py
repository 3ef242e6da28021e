"""A result as people see it: lines of text, a table in a notebook, pictures."""
