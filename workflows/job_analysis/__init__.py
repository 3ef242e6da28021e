"""Analyse the dump of a job, and write the results as text and as a page."""
