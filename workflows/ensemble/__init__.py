"""Many collisions of warm chains: one number for each seed, and what they say together."""
