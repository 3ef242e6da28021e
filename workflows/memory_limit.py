"""The limit of memory that a program was started with, which libraries meet without naming it."""

# Memory that Python, NumPy, Numba and LAMMPS need together before they compute anything.
_LEAST_MEGABYTES = 1000


def memory_is_short() -> str | None:
    """Return what to say where the limit is too small to load libraries; None where it is not."""
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return None
    limits = [resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA)]
    known = [limit for limit in limits if limit != resource.RLIM_INFINITY]
    if not known or min(known) > _LEAST_MEGABYTES * 2**20:
        return None
    return (
        f"the limit of memory set for this program, {min(known) / 2**20:.0f} MB, is too small to "
        f"load its libraries. Raise it to {_LEAST_MEGABYTES} MB or more (ulimit -v)"
    )
