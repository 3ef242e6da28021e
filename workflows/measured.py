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
    """
    Return all that was measured.

    Returns
    -------
    dict
        Name to ``value``, ``found``, ``quantile``, ``reserve``, ``samples``, ``seed`` and
        ``what``.
    """
    return tomllib.loads(resources.files("chaincor.workflows").joinpath(FILE).read_text())[
        "constants"
    ]


def measured(name: str) -> Any:
    """
    Return the value of a measured constant.

    Parameters
    ----------
    name : str
        Its name in the file.

    Returns
    -------
    float or dict
        One number, or one for each scheme.
    """
    return measurements()[name]["value"]
