"""Units of users, besides the units of the chain."""
