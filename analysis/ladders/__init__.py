"""
Order, limit and scatter of a quantity, from runs at decreasing time steps.

A ladder is a series of runs at decreasing time steps. Each rung of a ladder has several runs at
nearly equal time steps.
"""
