"""What a sweep costs, and what is left of one that is killed."""
