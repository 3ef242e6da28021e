"""What slow long chains lose: one curve for all bonds (``docs/explanation/slow_chains.md``)."""
