"""Figures, one kind in each module; each function draws into given or new axes and returns them."""
