"""Engines that run the collision of one scene and return a raw outcome."""
