"""How a collision answers to small changes: its linearised motion, forward and backward."""
