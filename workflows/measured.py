"""
Load measured constants, on which error bars and the choice of numerics depend.

``python -m benchmarks.bars.calibrate`` measures the constants over random scenes and writes
``measured.toml``. Each constant is a quantile of the samples times a safety factor. The file
contains the quantile, the safety factor, the number of samples and their seed.
"""

import tomllib
from functools import cache
from importlib import resources
from typing import Any

FILE = "measured.toml"


@cache
def measurements() -> dict[str, dict[str, Any]]:
    """Return the content of ``measured.toml``, by the name of the constant."""
    return tomllib.loads(resources.files("chaincor.workflows").joinpath(FILE).read_text())[
        "constants"
    ]


def measured(name: str, least: Any = 0.0) -> Any:
    """
    Return a measured constant, which is a number or a dictionary of numbers.

    The constant is at least `least`, a lower limit that the caller chooses and explains.
    """
    value = measurements()[name]["value"]
    if not isinstance(value, dict):
        return max(value, least)
    return {key: max(each, least[key] if least else each) for key, each in value.items()}
