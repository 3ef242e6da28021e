"""Many cold chains before a wall, carried in one compiled loop."""
