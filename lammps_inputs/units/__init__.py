"""Units that users choose instead of the chain's units."""
