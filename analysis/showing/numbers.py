"""Format numbers with the digits that are known, and the lines of a result."""

import math
from collections.abc import Iterable


def with_error(value: float, error: float | None) -> str:
    """Return a number and its error bar, without digits below the error bar."""
    if error is None:
        return f"{value:.12g} (no error bar asked for)"
    return f"{known_digits(value, error)} +- {error:.1e}"


def known_digits(value: float, error: float) -> str:
    """Return a number without digits below its error."""
    digits = 1
    while digits < 16 and error < 2.0 * 10.0**-digits:
        digits += 1
    return f"{value:.{digits}f}"


def root_of_known(root: float, error: float | None) -> str:
    """Return a number with six digits, or fewer if the error of its square is too large."""
    lost = 0.0 if not error else error / max(2.0 * abs(root), math.sqrt(error))
    return f"{root:.6g}" if lost < 2e-6 else known_digits(root, lost)


# If the error of a run is unknown, eta is not printed more finely than this, because more digits
# would suggest too high a precision.
_FINEST = 1e-12


def eta_of_dump(value: float, error: float | None, data_error: float) -> str:
    """Return a dump's restitution, with its total error and the error due to printed digits."""
    data = f"format and reading +- {data_error:.1e}"
    if error is not None:
        return f"{with_error(value, error)} ({data})"
    return f"{known_digits(value, max(data_error, _FINEST))}   (error of the run not known; {data})"


def impact_speed(velocity: float, v_star: float | None) -> str:
    """Return the impact speed as text, also in units of v* if the bond has one."""
    return f"v0 = {velocity:.6g}" + ("" if v_star is None else f" = {velocity / v_star:.6g} v*")


def named_lines(rows: Iterable[tuple[str, str]]) -> list[str]:
    """Return a line for each name and its text."""
    return [f"{name:22} {text}" for name, text in rows]
