"""Bonds: the interface of all potentials, named bonds, and bonds of users."""
