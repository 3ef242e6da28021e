"""Write HTML pages about runs, in one design and without links to other files."""
