"""Dissipation of slow long chains: one curve for all bonds of one order (``slow_chains.md``)."""
