"""Reader of the numbers that a finished script has printed to its log."""

import math
import re
from collections.abc import Iterable
from pathlib import Path

from chaincor.lammps_inputs.given_numbers import number_in
from chaincor.lammps_inputs.small_file import refuse_device

_NUMBER = r"([-+.\deE]+|null|[-+]?(?:nan|inf))"
# LAMMPS, or a job that stops without a result, prints these messages.
_STOPPED = re.compile(
    r"^(ERROR.*|(UNFINISHED|UNBALANCED|TOO FAST|NO VELOCITY|NO STEP|UNKNOWN NAME|OTHER VELOCITY"
    r"|BEHIND THE WALL|MISMATCHED|BEGUN OTHERWISE): .*)$",
    re.MULTILINE,
)
# Eta from a dump with all digits differs by at most this from the eta that LAMMPS prints.
_SAME_RUN = 1e-12


def end_of(log: Path, most_bytes: int) -> str:
    """Return the end of the printed output; raises InputError if it may never end."""
    refuse_device(log)
    with log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - most_bytes))
        return file.read().decode("utf-8", "replace")


def printed_values(log: str, name: str) -> list[float | None]:
    """
    Return the numbers of all lines with one name, such as ``restitution = 0.9``, in order.

    Scripts print ``null`` for an unknown number, which becomes nan. Other words become None.
    """
    said = re.findall(rf"^\s*{re.escape(name)} = {_NUMBER}\s*$", log, re.MULTILINE)
    return [math.nan if word == "null" else number_in(word) for word in said]


def printed_numbers(log: str, names: Iterable[str]) -> dict[str, float]:
    """Return the last number of each name, as :func:`printed_values` reads it."""
    last = {name: (printed_values(log, name) or [None])[-1] for name in names}
    return {name: value for name, value in last.items() if value is not None}


def stopped_with(log: str) -> str | None:
    """Return the message with which LAMMPS or a job stopped, in one line, or None."""
    said = _STOPPED.search(log)
    return None if said is None else " ".join(said[0].split())


def printed_error(
    logs: Iterable[Path], restitution: float, data_error: float
) -> tuple[float | None, str | None]:
    """
    Return the error of a restitution from a dump, as the logs of its run print it.

    A log has the lines ``restitution`` and ``restitution_error``. The first must agree with the
    dump within `data_error`, which is added to the second. The function returns the error, or None
    without one, and its source, or the reason why a log is not used. Both are None if the logs have
    no such lines.
    """
    other = None
    for path in logs:
        refuse_device(path)
        said = printed_numbers(
            path.read_text(errors="replace"), ("restitution", "restitution_error")
        )
        eta, error = said.get("restitution", math.nan), said.get("restitution_error", math.nan)
        if not (math.isfinite(eta) and 0.0 <= error < math.inf):
            continue
        if abs(eta - restitution) <= max(data_error, _SAME_RUN):
            return error + data_error, (
                f"restitution_error is the one that the run itself printed in {path.name}, "
                f"{error:.1e}, and that of format and reading"
            )
        other = (
            f"the error that {path.name} tells is not taken: it is that of restitution = "
            f"{eta:.9g}, and the dump says {restitution:.9g}; they are of different runs"
        )
    return None, other
