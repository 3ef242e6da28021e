"""A LAMMPS result of the user's own: a job's folder, a dump, or a log that says the restitution."""

import math
import re
from dataclasses import dataclass
from pathlib import Path

from chaincor.analysis.dumps.printed import printed_numbers, printed_values, stopped_with
from chaincor.analysis.job_folder import find_job
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import DEFAULT_TOLERANCE, Scene
from chaincor.workflows.job_analysis.analyze import analyze
from chaincor.workflows.validation.comparison import (
    Comparison,
    Validation,
    allowed_contacts,
    judge_for,
)

_MOST_BYTES = 4_000_000
_HEADS = (b"LAMMPS (", b"Log of LAMMPS")
# With what a log ends.
_ENDED = re.compile(r"^(Total wall time: .*|quit|log\s.*)$", re.MULTILINE)
# A job of chaincor's says its error last.
_JOB = re.compile(r"^variable +(restitution|step_error) string ", re.MULTILINE)


@dataclass(frozen=True)
class LammpsResult:
    """
    What LAMMPS found, by a run that somebody else made.

    Attributes
    ----------
    source : str
        Where it was read.
    scene : Scene or None
        Of ``scene.toml`` beside it.
    restitution : float
        Eta.
    restitution_error : float or None
        Its error; None where nothing tells it.
    contacts : int or None
        How many, where it says so.
    data_error : float
        Error of eta by the digits of a dump.
    """

    source: str
    scene: Scene | None
    restitution: float
    restitution_error: float | None
    contacts: int | None
    data_error: float = 0.0


def is_lammps_result(against: str | None) -> bool:
    """Return whether ``--against`` names a folder or a file that is no CSV, NPZ or module."""
    if against is None:
        return False
    path = Path(against)
    return path.suffix.lower() not in (".csv", ".npz", ".py") and (path.is_dir() or path.is_file())


def read_lammps_result(path: Path | str) -> LammpsResult:
    """
    Read a job's folder, a dump, or a log.

    A folder's dump is analysed as ``chaincor analyze`` does; one without a dump must hold
    ``log.lammps``. A log must be of one run that was finished, hold a line
    ``restitution = NUMBER``, and may hold ``restitution_error`` and ``contacts``. Raises InputError
    where nothing can be read.
    """
    path = Path(path)
    folder = path if path.is_dir() else path.parent
    beside = folder / "scene.toml"
    scene = Scene.from_file(beside) if beside.is_file() else None
    if path.is_dir() and not _has_dump(path) and (path / "log.lammps").is_file():
        path = path / "log.lammps"
    if path.is_file():
        found = _read_log(path, scene)
        if found is not None:
            return found
    analysis = analyze(folder, dump=None if path.is_dir() else path)
    return LammpsResult(
        str(path),
        scene,
        analysis.restitution,
        analysis.restitution_error,
        analysis.contacts,
        analysis.data_error,
    )


def validate_result(
    scene: Scene, found: LammpsResult, tolerance: float | None = None
) -> Validation:
    """
    Compare a LAMMPS result of the user's own with the in-house integrator.

    Where the result has no error bar, `tolerance`, by default the scene's or 1e-6, or what the
    digits of the dump leave, is the difference of eta that is still agreement.
    """
    asked = tolerance or scene.tolerance or DEFAULT_TOLERANCE
    judge = judge_for(scene, asked)
    known = found.restitution_error
    error = max(asked, found.data_error) if known is None else known
    comparisons = [
        Comparison(
            "restitution",
            abs(found.restitution - judge.restitution),
            error + (judge.restitution_error or 0.0),
        )
    ]
    if found.contacts is not None:
        difference = abs(found.contacts - judge.contacts)
        comparisons.append(Comparison("contacts", difference, allowed_contacts(judge)))
    return Validation(
        scene=scene,
        subject=f"LAMMPS, read from {found.source}",
        judge="in-house",
        restitution=found.restitution,
        judge_restitution=judge.restitution,
        comparisons=tuple(comparisons),
    )


def _has_dump(folder: Path) -> bool:
    try:
        find_job(folder)
    except InputError:
        return False
    return True


def _read_log(path: Path, scene: Scene | None) -> LammpsResult | None:
    """Return what a log says; None where it is no log."""
    try:
        with path.open("rb") as file:
            head = file.read(200)
            file.seek(max(0, path.stat().st_size - _MOST_BYTES))
            text = file.read().decode("utf-8", "replace")
    except OSError as error:
        raise InputError(f"cannot read {str(path)!r}: {error.strerror}") from None
    if not head.startswith(_HEADS) and "restitution = " not in text:
        return None
    said = printed_numbers(text, ("restitution", "restitution_error", "contacts"))
    found = {name: value for name, value in said.items() if math.isfinite(value)}
    if "restitution" not in found:
        raise InputError(
            f"the log {str(path)!r} holds no line 'restitution = NUMBER'; expected one: let the "
            "script print it, or name its dump"
        )
    _refuse_several(path, text)
    _refuse_unfinished(path, text, head.startswith(_HEADS))
    contacts = found.get("contacts")
    return LammpsResult(
        str(path),
        scene,
        found["restitution"],
        found.get("restitution_error"),
        None if contacts is None else round(contacts),
    )


def _refuse_several(path: Path, text: str) -> None:
    """Raise InputError where a log has results that differ: none is meant more than others."""
    said = printed_values(text, "restitution")
    values = [value for value in said if value is not None and math.isfinite(value)]
    if len(set(values)) > 1:
        raise InputError(
            f"the log {str(path)!r} holds {len(values)} lines 'restitution = NUMBER', from "
            f"{min(values):g} to {max(values):g}; expected one run: write the log of each into a "
            "file of its own"
        )


def _refuse_unfinished(path: Path, text: str, whole: bool) -> None:
    """Raise InputError where a log shows that its run was stopped; a `whole` one has its head."""
    if (said := stopped_with(text)) is not None:
        why = f"{said[:200]!r}"
    elif _JOB.search(text) is not None:
        if re.search(r"^restitution_error = ", text, re.MULTILINE) is not None:
            return
        why = "no line 'restitution_error = '"
    elif whole and _ENDED.search(text) is None:
        why = "no line 'Total wall time: '"
    else:
        return
    raise InputError(
        f"the log {str(path)!r} is of a run that was not finished: it has {why}; expected a "
        "finished one: run it to its end"
    )
