"""Results stores: one SQLite file with one row for each collision."""
