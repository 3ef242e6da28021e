"""Format durations."""

# Durations above ten thousand years are shown with one digit.
_TOO_LONG = 3e11


def format_duration(seconds: float) -> str:
    """Format a time in the largest unit of which it has at least two."""
    if seconds >= _TOO_LONG:
        return f"{seconds / 86400.0:.1g} days"
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{float(f'{seconds:.2g}'):g} s"
