"""Write self-contained HTML pages about runs, all with the same design."""
