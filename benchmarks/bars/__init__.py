"""Tests of error bars against true errors, and studies for the constants of error bars."""
