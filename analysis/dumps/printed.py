"""Read the results that a finished script has printed to its log."""

import math
import re
from collections.abc import Iterable
from pathlib import Path

from chaincor.lammps_inputs.given_numbers import number_in
from chaincor.lammps_inputs.small_file import refuse_device

_NUMBER = r"([-+.\deE]+|null|[-+]?(?:nan|inf))"
# Messages of LAMMPS, and of a script that stops without a result.
_STOPPED = re.compile(
    r"^(ERROR.*|(UNFINISHED|UNBALANCED|TOO FAST|NO VELOCITY|NO STEP|UNKNOWN NAME|OTHER VELOCITY"
    r"|BEHIND THE WALL|MISMATCHED|BEGUN OTHERWISE): .*)$",
    re.MULTILINE,
)
# Largest difference between the eta that LAMMPS printed and eta computed from a dump with all
# digits.
_SAME_RUN = 1e-12


def end_of(log: Path, most_bytes: int) -> str:
    """Return the last bytes of the printed output; raise InputError if the log is a device."""
    refuse_device(log)
    with log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - most_bytes))
        return file.read().decode("utf-8", "replace")


def printed_values(log: str, name: str) -> list[float | None]:
    """
    Return in order all numbers printed for one name, such as ``restitution = 0.9``.

    An unknown number, which scripts print as ``null``, is returned as nan. Texts that are not
    numbers are returned as None.
    """
    said = re.findall(rf"^\s*{re.escape(name)} = {_NUMBER}\s*$", log, re.MULTILINE)
    return [math.nan if word == "null" else number_in(word) for word in said]


def printed_numbers(log: str, names: Iterable[str]) -> dict[str, float]:
    """Return for each name the last number of :func:`printed_values`."""
    last = {name: (printed_values(log, name) or [None])[-1] for name in names}
    return {name: value for name, value in last.items() if value is not None}


def stopped_with(log: str) -> str | None:
    """Return in one line the message with which LAMMPS or a script stopped, or None."""
    said = _STOPPED.search(log)
    return None if said is None else " ".join(said[0].split())


def printed_error(
    logs: Iterable[Path], restitution: float, data_error: float
) -> tuple[float | None, str | None]:
    """
    Return the error of a dump's restitution, as printed in a log of the run.

    A log has the lines ``restitution`` and ``restitution_error``. The restitution must agree with
    that of the dump within `data_error`, which is added to the printed error. The function returns
    the error or None, and a text about the source of the error, or about why a log was not used.
    Error and text are None if no log has these lines.
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
                f"restitution_error combines the error printed in {path.name}, {error:.1e}, with "
                "the error from the format and frames of the dump"
            )
        other = (
            f"the error in {path.name} was not used: it belongs to restitution = {eta:.9g}, but "
            f"the dump gives {restitution:.9g}, so they are from different runs"
        )
    return None, other
