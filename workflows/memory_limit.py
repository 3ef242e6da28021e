"""Report if the memory limit of the process is too small for the libraries."""

# Python, NumPy, Numba and LAMMPS together need this much memory before they compute anything.
_LEAST_MEGABYTES = 1000


def memory_is_short() -> str | None:
    """Return a message if the memory limit is too small for loading the libraries, else None."""
    try:
        import resource
    except ImportError:  # Windows has no memory limit for processes.
        return None
    limits = [resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA)]
    known = [limit for limit in limits if limit != resource.RLIM_INFINITY]
    if not known or min(known) > _LEAST_MEGABYTES * 2**20:
        return None
    return (
        f"the limit of memory set for this program, {min(known) / 2**20:.0f} MB, is too small to "
        f"load its libraries. Raise it to {_LEAST_MEGABYTES} MB or more (ulimit -v)"
    )
