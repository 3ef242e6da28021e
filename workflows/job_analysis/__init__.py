"""Analyse the dump of a job, and write its numbers, text and page."""
