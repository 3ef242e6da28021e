"""Choose numerics for a tolerance, and compute error bars."""
