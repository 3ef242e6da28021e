"""Order, limit and scatter of a quantity along a ladder: runs at decreasing time steps."""
