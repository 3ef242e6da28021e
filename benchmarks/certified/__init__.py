"""Restitutions that are theorems: enclosures by ball arithmetic, which both engines must meet."""
