"""Schemes that a scene can name, with their orders and default steps."""

from typing import Literal

Scheme = Literal["verlet", "order4", "order6", "order8"]
# Runs with a tolerance and Python programs can also use other schemes: extrapolation of steps in
# both engines, and a splitting with modified kicks in the reference engine.
StepSchemeName = Scheme | Literal["srkn14", "extrapolated12", "extrapolated14", "extrapolated16"]
# The schemes that a scene can name have these orders of convergence with the impact-located wall.
SCHEME_ORDERS: dict[Scheme, int] = {"verlet": 2, "order4": 4, "order6": 6, "order8": 8}
# Each scheme has this composed step by default.
DEFAULT_TIMESTEPS = {"verlet": 0.0125, "order4": 0.05, "order6": 0.1, "order8": 0.2}
