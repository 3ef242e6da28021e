"""Engines that carry one scene through its collision and return a raw outcome."""
