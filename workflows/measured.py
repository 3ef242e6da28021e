"""
Constants that decide error bars and choices, measured by a study.

``python -m benchmarks.bars.calibrate`` measures them over random scenes and writes
``measured.toml``. Each value is a quantile of samples times a reserve; the file has both, with the
number of samples and their seed.
"""

import tomllib
from functools import cache
from importlib import resources
from typing import Any

FILE = "measured.toml"


@cache
def measurements() -> dict[str, dict[str, Any]]:
    """Return the content of ``measured.toml`` by name."""
    return tomllib.loads(resources.files("chaincor.workflows").joinpath(FILE).read_text())[
        "constants"
    ]


def measured(name: str, least: Any = 0.0) -> Any:
    """
    Return a measured constant by its name: one number, or one for each scheme.

    The value has the form of `least` and is not below it. The caller explains this choice.
    """
    value = measurements()[name]["value"]
    if not isinstance(value, dict):
        return max(value, least)
    return {key: max(each, least[key] if least else each) for key, each in value.items()}
