"""Scenes drawn at random, for studies of bars and for judges."""
