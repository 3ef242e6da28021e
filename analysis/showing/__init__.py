"""Display of results: known digits, text lines and notebooks."""
