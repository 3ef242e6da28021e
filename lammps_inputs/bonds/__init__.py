"""Bonds: the interface of a potential, named bonds, and bonds of users."""
