"""Proved enclosures of restitutions by ball arithmetic, which both engines must reproduce."""
