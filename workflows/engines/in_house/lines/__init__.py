"""The stepping engine for two bodies on a line: unequal masses, free targets, soft contacts."""
