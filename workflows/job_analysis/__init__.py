"""From the dump of a job to the physics: found, told in words, shown on a page."""
