"""Pages that people open after a run: one look for all, nothing loaded from elsewhere."""
