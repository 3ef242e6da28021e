"""Results kept: one SQLite file, one row a collision."""
