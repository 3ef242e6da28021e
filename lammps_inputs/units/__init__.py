"""Units of a user's own, beside those of the chain."""
