"""Times as people read them."""


def format_duration(seconds: float) -> str:
    """Format a time for people, in the largest unit of which it holds two."""
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.2g} s"
