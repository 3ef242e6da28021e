"""A LAMMPS result of the user's own: a job's folder, a dump, or a log that says the restitution."""

import math
from dataclasses import dataclass
from pathlib import Path

from chaincor.analysis.job_folder import find_job
from chaincor.analysis.results import CollisionAnalysis
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import DEFAULT_TOLERANCE, Scene
from chaincor.workflows.job_analysis.analyze import analyze
from chaincor.workflows.scripted.printed import printed_numbers
from chaincor.workflows.validation.comparison import Comparison, Validation, judge_for

_MOST_BYTES = 4_000_000


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
    """Return whether ``--against`` names a folder or a file that is no CSV or NPZ."""
    if against is None:
        return False
    path = Path(against)
    return path.suffix.lower() not in (".csv", ".npz") and (path.is_dir() or path.is_file())


def read_lammps_result(path: Path | str) -> LammpsResult:
    """
    Read a job's folder, a dump, or a log.

    A folder's dump is analysed as ``chaincor analyze`` does; one without a dump must hold
    ``log.lammps``. A log must hold a line ``restitution = NUMBER``, the last of which counts, and
    may hold ``restitution_error`` and ``contacts``. Raises InputError where nothing can be read.
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
    error = contacts = None
    if isinstance(analysis, CollisionAnalysis):
        error, contacts = analysis.restitution_error, analysis.contacts
    return LammpsResult(
        str(path), scene, analysis.restitution, error, contacts, analysis.data_error
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
        allowed = None if judge.ending == "open" else 0.0
        comparisons.append(Comparison("contacts", abs(found.contacts - judge.contacts), allowed))
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
    if not head.startswith((b"LAMMPS (", b"Log of LAMMPS")) and "restitution = " not in text:
        return None
    said = printed_numbers(text, ("restitution", "restitution_error", "contacts"))
    found = {name: value for name, value in said.items() if math.isfinite(value)}
    if "restitution" not in found:
        raise InputError(
            f"the log {str(path)!r} holds no line 'restitution = NUMBER'; expected one: let the "
            "script print it, or name its dump"
        )
    contacts = found.get("contacts")
    return LammpsResult(
        str(path),
        scene,
        found["restitution"],
        found.get("restitution_error"),
        None if contacts is None else round(contacts),
    )
