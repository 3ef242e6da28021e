"""
Load measured constants, which decide error bars and choices.

``python -m benchmarks.bars.calibrate`` measures the constants over random scenes and writes
``measured.toml``. Each value is a quantile of the samples times a safety factor. The file contains
both, with the number of samples and their seed.
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
    Return a measured constant by its name, as one number or one for each scheme.

    The value has the type of `least` and is at least `least`, a lower limit that the caller
    explains.
    """
    value = measurements()[name]["value"]
    if not isinstance(value, dict):
        return max(value, least)
    return {key: max(each, least[key] if least else each) for key, each in value.items()}
