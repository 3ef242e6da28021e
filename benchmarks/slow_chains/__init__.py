"""Energy loss of slow long chains: studies for ``docs/explanation/slow_chains.md``."""
