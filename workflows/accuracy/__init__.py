"""Choice of numerics for a tolerance, and error bars."""
