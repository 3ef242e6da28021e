"""Figures, one kind per module. Each function draws into given or new axes and returns the axes."""
