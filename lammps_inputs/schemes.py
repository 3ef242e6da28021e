"""The schemes that a scene can name, their orders, and steps to begin with."""

from typing import Literal

Scheme = Literal["verlet", "order4", "order6", "order8"]
# What engines can do besides, where a tolerance lets them choose or Python names it: extrapolate
# steps, both of them, and in-house a splitting with kicks of its own.
StepSchemeName = Scheme | Literal["srkn14", "extrapolated12", "extrapolated14", "extrapolated16"]
# Order of convergence of what a scene can name, with the impact-located wall.
SCHEME_ORDERS: dict[Scheme, int] = {"verlet": 2, "order4": 4, "order6": 6, "order8": 8}
# Composed steps that are a sensible start for each scheme where the user names none.
DEFAULT_TIMESTEPS = {"verlet": 0.0125, "order4": 0.05, "order6": 0.1, "order8": 0.2}
