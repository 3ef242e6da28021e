"""Analysis of the dump of a job: its numbers, text and page."""
