"""HTML pages about runs, with one design and without content from elsewhere."""
