"""Energy loss of slow long chains: the studies behind ``docs/explanation/slow_chains.md``."""
