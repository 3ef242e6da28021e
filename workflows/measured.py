"""
Constants that decide error bars and choices, measured and not chosen.

``python -m benchmarks.bars.calibrate`` measures them over random scenes and writes
``measured.toml``: each with its value, the quantile of what was found and the reserve on it that
make the value, the number of samples and the seed that drew them.
"""

import tomllib
from functools import cache
from importlib import resources
from typing import Any

FILE = "measured.toml"


@cache
def measurements() -> dict[str, dict[str, Any]]:
    """Return all that was measured, by name, as ``measured.toml`` has it."""
    return tomllib.loads(resources.files("chaincor.workflows").joinpath(FILE).read_text())[
        "constants"
    ]


def measured(name: str, least: Any = 0.0) -> Any:
    """
    Return a measured constant by its name: one number, or one for each scheme.

    It is nowhere less than `least`, of the same form: a choice, whose reason stands where it is
    used.
    """
    value = measurements()[name]["value"]
    if not isinstance(value, dict):
        return max(value, least)
    return {key: max(each, least[key] if least else each) for key, each in value.items()}
