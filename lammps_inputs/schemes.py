"""Schemes that a scene can name, with their orders and default steps."""

from typing import Literal

Scheme = Literal["verlet", "order4", "order6", "order8"]
# Runs with a tolerance and Python programs can use further schemes: extrapolation to a time step of
# zero in both engines, and a splitting method with modified kicks in the reference engine.
StepSchemeName = Scheme | Literal["srkn14", "extrapolated12", "extrapolated14", "extrapolated16"]
# Orders of convergence with the impact-located wall, for the schemes that a scene can name.
SCHEME_ORDERS: dict[Scheme, int] = {"verlet": 2, "order4": 4, "order6": 6, "order8": 8}
# Default composed step of each scheme.
DEFAULT_TIMESTEPS = {"verlet": 0.0125, "order4": 0.05, "order6": 0.1, "order8": 0.2}
