"""Schemes that others found best, against those of the engines, in force evaluations."""
