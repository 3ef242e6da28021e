"""Keep results in a store, an SQLite file with one row for each collision."""
