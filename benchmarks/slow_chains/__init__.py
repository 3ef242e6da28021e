"""What slow long chains lose: the studies behind ``docs/explanation/slow_chains.md``."""
